"""The robot as ROS 2 users expect it, without a transport: joint states, transforms, joint
trajectories."""
