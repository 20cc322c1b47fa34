"""The ROS side of a robot: its node, and the fronts through which others reach it."""
