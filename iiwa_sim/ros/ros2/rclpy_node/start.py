"""Starts the node of ROS 2: run as a script, since its interpreter knows no package iiwa_sim."""

import sys
from importlib import import_module
from pathlib import Path

if __name__ == "__main__":
    # Appended, not in front: the folder's modules must not hide those that rclpy loads.
    sys.path = [*sys.path[1:], str(Path(__file__).resolve().parent.parent)]
    import_module("rclpy_node.main").run()
