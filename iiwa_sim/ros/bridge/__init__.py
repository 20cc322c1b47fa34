"""The ROS side for any server of the iiwa's line protocol, emulated or real: a client of ours drives it."""
