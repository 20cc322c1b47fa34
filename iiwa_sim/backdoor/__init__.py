"""The interface of a test bench: methods, also over HTTP, for robot, cell, time and wire."""
