"""The options of the command `iiwa-sim` without a subcommand."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from iiwa_sim.cli.addresses import add_addresses
from iiwa_sim.cli.consistency import check, check_dialect
from iiwa_sim.cli.environment import RULE, read_environment
from iiwa_sim.cli.names import REPLAY, SUBCOMMANDS, summaries
from iiwa_sim.cli.options import (
    add_log,
    add_rate,
    add_robot,
    add_ros,
)
from iiwa_sim.cli.parsing import Parser, path, whole
from iiwa_sim.cli.reach import BACKDOOR, PAGE, add_reach
from iiwa_sim.clock.clock import MAX_RATE_HZ
from iiwa_sim.clock.pace import EXPECTED, MAX_SPEED, MIN_SPEED, REAL, Pace, pace
from iiwa_sim.controller.modes import LONGEST_SERVO_TIMEOUT_S
from iiwa_sim.dialect.ports import MAX_PORT
from iiwa_sim.dialect.wire.decimals import parse_decimal
from iiwa_sim.dialect.wire.names import Names
from iiwa_sim.serve import status_stream
from iiwa_sim.serve.admission import LONGEST_PAUSE_S
from iiwa_sim.wording import shortened

SECTIONS = {
    "robots": "cell robot count fleet",
    "connections": "dialect host port strict exclusive reconnect_pause bye_shuts_down",
    "time": "clock rate servo_timeout",
    "output": "status view transcript record log",
    "test bench": "backdoor",
    "ROS": "rosbridge ros ros2",
}
EXAMPLES = {
    "": "an LBR iiwa 7 on port 30000 of this machine",
    "examples/table.toml --clock fast": "one in front of a table, in simulated time that runs as fast as "
    "it can",
    "--robot kr_6_r900_sixx --dialect krc4": "a KR 6 that speaks KRC4 messages",
}


def parsed(given: Sequence[str], environment: Mapping[str, str]) -> argparse.Namespace:
    """The options for a run, from command line and environment, checked for consistency.

    With a fleet they are the defaults of its robots.
    """
    parser = server_parser()
    options = parser.parse_args(given)
    if options.version:
        return options
    found = read_environment(parser, environment)  # after --help has had its chance
    options = parser.parse_args(given, found)
    if options.fleet is None:
        check(parser.error, options)
        check_dialect(parser.error, options, options.dialect)
    elif options.count is not None:
        parser.error("argument --fleet: expected no --count with it: the file names its robots")
    return options


def server_parser() -> Parser:
    """The parser for all options of the command without a subcommand."""
    # Subcommands have parsers of their own, chosen by the first argument.
    parser = Parser(
        prog="iiwa-sim",
        usage="iiwa-sim [CELL.toml] [OPTION ...]\n       iiwa-sim COMMAND ... (see iiwa-sim COMMAND --help)",
        description="A robot controller in software that speaks the text protocol of the KUKA LBR iiwa, "
        "and the messages of a KUKA KRC4.",
        sections=SECTIONS,
        commands=summaries,
        examples=EXAMPLES,
        epilog=f"{RULE} To talk to it: telnet HOST PORT, then help",
    )
    parser.add_argument(
        "cell",
        nargs="?",
        type=_cell,
        metavar="CELL.toml",
        help="robot, start pose, tool, surfaces and parts (default: a robot alone)",
    )
    add_robot(parser)
    add_addresses(parser)
    add_rate(parser)
    parser.add_argument(
        "--clock",
        type=_pace,
        default=REAL,
        metavar="real|10x|fast|stepped",
        help=f"how simulated time passes: in real time, {MIN_SPEED:g} to {MAX_SPEED:g} times as fast, as "
        "fast as it can while the robot moves, or only when a test advances it (default: real)",
    )
    parser.add_argument(
        "--servo-timeout",
        type=_seconds(LONGEST_SERVO_TIMEOUT_S),
        metavar="SECONDS",
        help="stop the robot when no smart or direct move follows the last one within this time, above 0 and "
        f"up to {LONGEST_SERVO_TIMEOUT_S:g} (default: never)",
    )
    parser.add_argument(
        "--status-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="send the robot's state to all clients of this port, as lines of JSON, and take the line "
        "'stop'; 0 picks a port (default: no such port)",
    )
    low_hz, high_hz = status_stream.MIN_RATE_HZ, status_stream.MAX_RATE_HZ
    parser.add_argument(
        "--status-rate",
        type=whole(low_hz, high_hz),
        metavar="HZ",
        help=f"lines per second on that port, {low_hz} to {high_hz}, and not above the --rate "
        f"(default: {status_stream.DEFAULT_RATE_HZ})",
    )
    add_ros(parser)
    parser.add_argument(
        "--backdoor-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="take commands of a test bench on this port: faults, pushes, and more; 0 picks a port "
        "(default: no such port)",
    )
    parser.add_argument(
        "--backdoor-http-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="the same as JSON over HTTP, as POST /backdoor/emergency-stop, with GET /state, /dialogue, "
        "/healthz; 0 picks a port (default: no such port)",
    )
    add_reach(parser, "backdoor-", BACKDOOR)
    parser.add_argument(
        "--view-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="serve a web page on this port to see the robot, push it and stop it; 0 picks a port. It "
        "opens a status port and a backdoor on free ports where none are named (default: no such page)",
    )
    add_reach(parser, "view-", PAGE)
    parser.add_argument(
        "--strict",
        action="store_true",
        help="answer error to a line with more values than its command takes (default: they are ignored, as "
        "by the original, with a warning in the log)",
    )
    parser.add_argument(
        "--exclusive",
        action="store_true",
        help="serve one client after the other; others wait (default: all at once)",
    )
    parser.add_argument(
        "--reconnect-pause",
        type=_seconds(LONGEST_PAUSE_S, or_zero=True),
        default=0.0,
        metavar="SECONDS",
        help=f"wait so long between the last client and the next one, up to {LONGEST_PAUSE_S:g} (default: 0)",
    )
    parser.add_argument(
        "--transcript",
        type=path,
        metavar="FILE",
        help=f"write the dialogue in all dialects into this file; iiwa-sim {REPLAY} plays it",
    )
    parser.add_argument(
        "--record",
        type=path,
        metavar="FILE.mcap",
        help="record the whole run into this file, for Foxglove, PlotJuggler and iiwa-sim plot, export, "
        "replay; needs the extra record",
    )
    parser.add_argument(
        "--record-rate",
        type=whole(1, MAX_RATE_HZ),
        metavar="HZ",
        help="states per second in the recording, not above the --rate (default: one at every tick)",
    )
    parser.add_argument("--bye-shuts-down", action="store_true", help="end when a client says bye")
    add_log(parser)
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    return parser


def _cell(text: str) -> str:
    """Raises ArgumentTypeError for what is no file, but nearly a subcommand."""
    meant = Names(SUBCOMMANDS).nearest(text.encode()) if text else None
    if meant is not None and not Path(text).exists():
        raise argparse.ArgumentTypeError(f"{text!r} is no file and no command; did you mean {meant}?")
    return text


def _pace(text: str) -> Pace:
    try:
        return pace(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{shortened(repr(text), 40)} is not {EXPECTED}") from None


def _seconds(longest_s: float, *, or_zero: bool = False) -> Callable[[str], float]:
    def seconds(text: str) -> float:
        try:
            value = parse_decimal(text.encode())
        except ValueError:
            value = -1.0
        if not (0.0 < value <= longest_s or (or_zero and value == 0.0)):
            shown = shortened(repr(text), 40)
            limits = f"from 0 to {longest_s:g}" if or_zero else f"above 0 and up to {longest_s:g}"
            raise argparse.ArgumentTypeError(f"{shown} is not a number of seconds {limits}")
        return value

    return seconds
