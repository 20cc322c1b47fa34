"""How the robot moves: paths in joint space, the timing along them, and the drive that runs them by ticks.

A planned move is a path q(s), s from 0 to 1, and a timing s(t) that keeps every joint within its limits. The
drive advances planned time; a stop only slows that time down, so the robot never leaves its path.
"""
