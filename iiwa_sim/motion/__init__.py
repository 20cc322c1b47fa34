"""How the robot moves: paths in joint space, the timing along them, and the executor that runs them by ticks.

A planned move is a path q(s), s from 0 to 1, and a timing that keeps every joint within its limits. The
executor advances planned time. `TimeScaling` slows that time down in a stop, so the robot stays on its path,
unless it is compliant: then it brakes from where it was pushed to.
"""
