"""Motion: paths in joint space, speed profiles along them, and the executor that runs them by ticks.

A planned move is a path q(s), s from 0 to 1, and a speed profile that keeps every joint within its limits.
The executor advances planned time. `TimeScaling` slows that time down in a stop, so the robot stays on its
path. A compliant robot brakes from where forces have pushed it.
"""
