"""The ROS side as a node of ROS 1, by rospy."""
