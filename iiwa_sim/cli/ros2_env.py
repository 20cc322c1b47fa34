"""`iiwa-sim ros2-env`: makes an environment with rclpy for `--ros2`, from wheels."""

import sys
from collections.abc import Sequence

from iiwa_sim.cli.names import ROS2_ENV
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser, path


def run(given: Sequence[str]) -> int:
    from iiwa_sim.ros.ros2.environment import default_folder, make, python_in

    folder = _parser().parse_args(given).folder or default_folder()
    lacking = make(folder)
    if lacking:
        sys.stderr.write(
            "iiwa-sim: without the action FollowJointTrajectory, /tf and Appendix A, whose types need a C++ "
            f"compiler and Python's headers (g++, python3-dev): {lacking}\n"
        )
    say(f"{python_in(folder)}\n")
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {ROS2_ENV}",
        description="Makes a Python environment with rclpy, from wheels on PyPI for x86-64 Linux (270 MB), "
        "and prints its interpreter. iiwa-sim --ros2 finds it in the default folder. Types that no wheel has "
        "(control_msgs, tf2_msgs, robot_movement_interface) are compiled where a C++ compiler is.",
        examples={"": "makes the environment that --ros2 looks for"},
    )
    parser.add_argument(
        "folder",
        nargs="?",
        type=path,
        metavar="FOLDER",
        help="folder to make it in (default: iiwa-sim/ros2 in $XDG_CACHE_HOME, or in ~/.cache)",
    )
    return parser
