"""Puts any robot that speaks the iiwa's line protocol, simulated or real, on ROS, through our client."""
