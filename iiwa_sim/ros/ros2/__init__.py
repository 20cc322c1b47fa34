"""The ROS side as a node of ROS 2: a process of its own, in an environment of its own, and what talks to
it."""
