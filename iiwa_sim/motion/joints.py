"""Joint positions as all of motion hands them on."""

Joints = tuple[float, ...]
"""rad, base first"""
