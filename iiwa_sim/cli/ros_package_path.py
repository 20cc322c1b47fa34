"""`iiwa-sim ros-package-path`: the folder with the message types of the ROS side, for the tools of ROS."""

from collections.abc import Sequence
from importlib.resources import files

from iiwa_sim.cli.names import ROS_PACKAGE_PATH
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser


def run(given: Sequence[str]) -> int:
    _parser().parse_args(given)
    say(f"{files('iiwa_sim.protocol').joinpath('rmi')}\n")
    return 0


def _parser() -> Parser:
    return Parser(
        prog=f"iiwa-sim {ROS_PACKAGE_PATH}",
        description="Prints the folder with the ROS packages of the node's types, for rostopic, rosservice "
        f"and rosmsg: export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH:$(iiwa-sim {ROS_PACKAGE_PATH})",
        examples={"": "the folder, to be put into ROS_PACKAGE_PATH"},
    )
