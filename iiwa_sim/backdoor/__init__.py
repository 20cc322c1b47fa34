"""Fault injection interface used by tests: methods, also over HTTP, for robot, cell, time and wire."""
