"""The side of a test bench: what befalls robot, cell, time and wire, as methods and as lines."""
