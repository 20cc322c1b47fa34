"""`iiwa-sim moveit-config`: writes what MoveIt and ros2_control are told of a robot."""

from collections.abc import Sequence
from pathlib import Path

from iiwa_sim.cli.names import MOVEIT_CONFIG
from iiwa_sim.cli.options import add_robot
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser, path
from iiwa_sim.robot.description import DEFAULT_ROBOT
from iiwa_sim.wording import Unusable


class FolderFault(Unusable):
    """The folder cannot be written to."""


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    from iiwa_sim.moveit.files import files
    from iiwa_sim.moveit.pairs import disabled_pairs
    from iiwa_sim.robot.description import load_robot

    robot = load_robot(options.robot or DEFAULT_ROBOT)
    folder: Path = options.folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        texts = files(robot, disabled_pairs(robot))
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
    except OSError as fault:
        raise FolderFault(f"{folder} cannot be written: {fault.strerror}") from None
    for name in texts:
        say(f"{folder / name}\n")
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {MOVEIT_CONFIG}",
        description="Writes a robot's URDF and SRDF, and settings for MoveIt and ros2_control, into a "
        "folder, and prints their names. Links that need not be compared for collisions are found by 10,000 "
        "samples.",
        examples={"config": "those of the LBR iiwa 7", "config --robot kr_6_r900_sixx": "those of another"},
    )
    parser.add_argument("folder", type=path, metavar="FOLDER", help="folder to write them into")
    add_robot(parser)
    return parser
