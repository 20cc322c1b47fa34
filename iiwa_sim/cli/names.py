"""The names of the subcommands, each a module of this package with `run`."""

PLOT = "plot"
CHECK_CELL = "check-cell"
REPLAY = "replay"
CHECK = "check"
BRIDGE = "bridge"
HEALTH = "health"
ROS_PACKAGE_PATH = "ros-package-path"
SUBCOMMANDS = (PLOT, CHECK_CELL, REPLAY, CHECK, BRIDGE, HEALTH, ROS_PACKAGE_PATH)
"""The first arguments that select a subcommand."""
SERVE = "serve"
"""The command without a subcommand."""
