"""What MoveIt and ros2_control are told of a robot: a URDF, an SRDF and their settings, made of its
description."""
