"""Options that subcommands share."""

import argparse
from collections.abc import Callable

from iiwa_sim import log
from iiwa_sim.cli.names import ROS2_ENV, ROS_PACKAGE_PATH
from iiwa_sim.cli.parsing import Error, Parser, path, whole
from iiwa_sim.cli.reach import secret_in
from iiwa_sim.clock.clock import DEFAULT_RATE_HZ, MAX_RATE_HZ, MIN_RATE_HZ
from iiwa_sim.dialect.ports import MAX_PORT
from iiwa_sim.robot.description import DEFAULT_ROBOT, built_in_robots
from iiwa_sim.ros.options import APPLY, IGNORE, NEWEST_RESULT, REAL, RESULT_CONSTANTS, SIMULATED, RosOptions
from iiwa_sim.serve.web_access import WebAccess
from iiwa_sim.wording import shortened


def check_robot(error: Error, options: argparse.Namespace) -> None:
    """A cell and a robot exclude each other; `error` ends the program."""
    if options.cell is not None and options.robot is not None:
        error("argument --robot: expected no cell with it, which names its robot")


def add_server(parser: Parser) -> None:
    parser.add_argument("server", type=server_address, metavar="HOST:PORT", help="where the server listens")


def add_servers(parser: Parser) -> None:
    parser.add_argument(
        "server",
        type=_servers,
        metavar="HOST:PORT[,PORT]",
        help="where the server listens, a port for each dialect of the transcript",
    )


def server_address(text: str) -> tuple[str, int]:
    """HOST:PORT. Raises ArgumentTypeError."""
    host, ports = _servers(text)
    if len(ports) != 1:
        raise _no_server(text)
    return host, ports[0]


def _servers(text: str) -> tuple[str, list[int]]:
    host, _, ports = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    words = ports.split(",")
    if not host or not all(
        port.isascii() and port.isdigit() and len(port) < 6 and 1 <= int(port) <= MAX_PORT for port in words
    ):
        raise _no_server(text)
    return host, [int(port) for port in words]


def _no_server(text: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(f"{shortened(repr(text), 40)} is not HOST:PORT")


def add_robot(parser: Parser) -> None:
    parser.add_argument(
        "--robot",
        metavar="NAME|FOLDER",
        help=f"{', '.join(built_in_robots())}, or your own (default: {DEFAULT_ROBOT})",
    )


def add_log(parser: Parser) -> None:
    parser.add_argument(
        "--log-level",
        choices=log.LEVELS,
        default=log.DEFAULT_LEVEL,
        help="error: internal errors; warning: also refused commands, clients that vanish while "
        "the robot moves, servo timeouts and forces that end a move; info: also clients that come and go; "
        "debug: also every command (default: %(default)s)",
    )
    parser.add_argument("--log-json", action="store_true", help="log JSON, one object per line")


def add_ros(parser: Parser) -> None:
    """The options of a robot on ROS."""
    parser.add_argument(
        "--rosbridge-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="offer drag&bot's topics and services on this port, by rosbridge; 0 picks a port, 9090 is usual "
        "(default: no such port)",
    )
    parser.add_argument(
        "--rosbridge-secret",
        type=secret_in,
        metavar="FILE",
        help="serve only clients of rosbridge that know the secret in this file (default: all)",
    )
    parser.add_argument(
        "--rosbridge-origin",
        type=_origin,
        action="append",
        default=[],
        metavar="ORIGIN",
        help="let web pages from there use rosbridge, scheme://host or scheme://host:port; can be repeated "
        "(default: pages of this machine only)",
    )
    parser.add_argument(
        "--rosbridge-host",
        type=_host,
        action="append",
        default=[],
        metavar="NAME",
        help="let clients use rosbridge by this name of the machine, too; can be repeated (default: its "
        "addresses and localhost only)",
    )
    parser.add_argument(
        "--ros",
        action="store_true",
        help="be a node of ROS 1 with the same topics and services, at ROS_MASTER_URI; needs rospy. Tools "
        f"find its types by export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH:$(iiwa-sim {ROS_PACKAGE_PATH})",
    )
    parser.add_argument(
        "--ros-result",
        type=int,
        choices=RESULT_CONSTANTS,
        help="the year of robot_movement_interface whose type /command_result has; clients on ROS 1 with the "
        f"type of another year receive no results (default: {NEWEST_RESULT})",
    )
    parser.add_argument(
        "--ros-reference",
        choices=(APPLY, IGNORE),
        help="what to do with a pose_reference_frame with values, unless pose_reference names the base: "
        f"apply it, or ignore it where poses are in the base already (default: {APPLY})",
    )
    parser.add_argument(
        "--ros2",
        action="store_true",
        help="be a node of ROS 2, in a process of its own: joint states, /clock, joint trajectories and "
        "more; found from this machine only, unless ROS_AUTOMATIC_DISCOVERY_RANGE says otherwise",
    )
    parser.add_argument(
        "--ros2-python",
        type=path,
        metavar="PATH",
        help=f"the interpreter of that process, which has rclpy (default: that of iiwa-sim {ROS2_ENV}, or a "
        "sourced distribution's)",
    )
    parser.add_argument(
        "--ros-namespace",
        default="",
        metavar="NAME",
        help="put that node, its topics and services under this namespace (default: none)",
    )
    parser.add_argument(
        "--ros-stamps",
        choices=(REAL, SIMULATED),
        help="the time in headers: real, or simulated as on /clock, for nodes with use_sim_time and for "
        f"clocks other than real (default: {REAL})",
    )


def ros_options(options: argparse.Namespace) -> RosOptions:
    """The options of a robot on ROS."""
    return RosOptions(
        host=options.host,
        rosbridge_port=options.rosbridge_port,
        rosbridge_secret=options.rosbridge_secret,
        rosbridge_origins=options.rosbridge_origin,
        rosbridge_hosts=options.rosbridge_host,
        ros=options.ros,
        ros2=options.ros2,
        ros2_python=options.ros2_python,
        ros_namespace=options.ros_namespace,
        ros_result=options.ros_result or NEWEST_RESULT,
        ros_reference=options.ros_reference or APPLY,
        ros_stamps=options.ros_stamps or REAL,
    )


def add_rate(parser: Parser, default: int | None = DEFAULT_RATE_HZ) -> None:
    parser.add_argument(
        "--rate",
        type=whole(MIN_RATE_HZ, MAX_RATE_HZ),
        default=default,
        metavar="HZ",
        help=f"ticks per second, {MIN_RATE_HZ} to {MAX_RATE_HZ} (default: {DEFAULT_RATE_HZ})",
    )


def _origin(text: str) -> str:
    return _accepted(text, lambda: WebAccess(origins=[text]))


def _host(text: str) -> str:
    return _accepted(text, lambda: WebAccess(hosts=[text]))


def _accepted(text: str, check: Callable[[], object]) -> str:
    try:
        check()
    except ValueError as fault:
        raise argparse.ArgumentTypeError(str(fault)) from None
    return text
