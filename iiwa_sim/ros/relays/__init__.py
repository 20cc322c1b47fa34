"""Nodes of ROS 1 and ROS 2, run by an interpreter that has rospy or rclpy and nothing of iiwa-sim."""
