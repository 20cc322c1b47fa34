"""The interface of a test bench: it manipulates robot, cell, time and wire, by methods or lines of text."""
