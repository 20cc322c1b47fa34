"""What this driver knows of the robot."""

POSES = {
    "above": (450.0, 0.0, 520.0, 0.0, -1.570792654, 0.0),
    "left": (450.0, 200.0, 520.0, 0.0, -1.570792654, 0.0),
}
"""Frames of the TCP: mm and rad."""
