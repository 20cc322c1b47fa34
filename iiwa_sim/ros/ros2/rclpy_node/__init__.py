"""The node of ROS 2 as a program of an interpreter that has rclpy and nothing of iiwa-sim."""
