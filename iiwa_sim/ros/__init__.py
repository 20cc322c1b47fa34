"""The ROS side of a robot: its node, and the transports by which others reach it."""
