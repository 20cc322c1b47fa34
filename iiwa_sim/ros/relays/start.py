"""Starts a relay, `start.py ros1` or `start.py ros2`: its interpreter knows no package iiwa_sim."""

import sys
from importlib import import_module
from pathlib import Path

if __name__ == "__main__":
    # Appended, not in front: the folder's modules must not hide those of ROS.
    sys.path = [*sys.path[1:], str(Path(__file__).resolve().parents[1])]
    import_module("relays.pipe").run(sys.argv[1])
