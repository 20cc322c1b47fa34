"""The names of the commands, each a module of this package with `run`."""

PLOT = "plot"
CHECK_CELL = "check-cell"
REPLAY = "replay"
EXPORT = "export"
CHECK = "check"
BRIDGE = "bridge"
HEALTH = "health"
ROS_PACKAGE_PATH = "ros-package-path"
SUBCOMMANDS = (PLOT, CHECK_CELL, REPLAY, EXPORT, CHECK, BRIDGE, HEALTH, ROS_PACKAGE_PATH)
"""What may come behind `iiwa-sim`."""
SERVE = "serve"
"""The bare `iiwa-sim`."""
