"""The names of the subcommands, each a module of this package with `run`."""

from importlib import import_module

PLOT = "plot"
CHECK_CELL = "check-cell"
REPLAY = "replay"
EXPORT = "export"
SHOW = "show"
CHECK = "check"
HEALTH = "health"
ROS_PACKAGE_PATH = "ros-package-path"
ROS2_ENV = "ros2-env"
VIEW = "view"
SUBCOMMANDS = (*(PLOT, CHECK_CELL, REPLAY, EXPORT, SHOW, CHECK, VIEW, HEALTH, ROS_PACKAGE_PATH, ROS2_ENV),)
"""The first arguments that select a subcommand."""
SERVE = "serve"
"""The command without a subcommand."""


def module_of(command: str) -> str:
    """The name of a command's module."""
    return f"iiwa_sim.cli.{command.replace('-', '_')}"


def summaries() -> dict[str, str]:
    """What each subcommand is for: the first sentence of its module, behind its name."""
    return {name: _first_sentence(str(import_module(module_of(name)).__doc__)) for name in SUBCOMMANDS}


def _first_sentence(text: str) -> str:
    return " ".join(text.partition(".")[0].partition(": ")[2].split())
