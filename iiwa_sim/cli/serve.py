"""The bare `iiwa-sim`: its options, and the run until a signal or a bye that is to end it."""

import argparse
import asyncio
import gc
import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from iiwa_sim import log
from iiwa_sim.backdoor.token import LOOPBACK, Token, check_reach
from iiwa_sim.cli.ending import Ending
from iiwa_sim.cli.environment import RULE, read_environment, unknown_variables
from iiwa_sim.cli.names import REPLAY, SUBCOMMANDS
from iiwa_sim.cli.options import (
    Parser,
    add_host,
    add_log,
    add_rate,
    add_robot,
    add_ros,
    add_ros_conventions,
    add_rosbridge,
    check_robot,
    ros_conventions,
    secret_in,
    whole,
)
from iiwa_sim.cli.output import announce, say
from iiwa_sim.clock.pace import EXPECTED, MAX_SPEED, MIN_SPEED, REAL, Pace, pace
from iiwa_sim.controller.modes import LONGEST_SERVO_TIMEOUT_S
from iiwa_sim.dialect.ports import DEFAULT_DIALECT, DEFAULT_PORTS
from iiwa_sim.dialect.wire.decimals import parse_decimal
from iiwa_sim.serve import status_stream
from iiwa_sim.serve.listening import MAX_PORT, host_and_port
from iiwa_sim.serve.turns import LONGEST_PAUSE_S
from iiwa_sim.wording import shortened

if TYPE_CHECKING:
    from iiwa_sim.simulator import Simulator

logger = logging.getLogger(__name__)


def run(given: Sequence[str]) -> int:
    options = parsed(given, os.environ)
    if options.version:
        say(f"iiwa-sim {metadata.version('iiwa-sim')}\n")
        return 0
    if sys.stderr is not None:
        log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    for name in unknown_variables(server_parser(), os.environ):
        logger.warning("the environment variable %s is no option of iiwa-sim: see iiwa-sim --help", name)
    gc.disable()  # nothing made during the start is garbage
    asyncio.run(_serve(options))
    return 0


async def _serve(options: argparse.Namespace) -> None:
    # Pinocchio and Ruckig take their time to load: not before the options are known to be right.
    from iiwa_sim.simulator import Simulator

    ending = Ending()
    simulator = Simulator(
        options.robot,
        cell=options.cell,
        dialects=options.dialect,
        host=options.host,
        port=options.port,
        rate_hz=options.rate,
        clock=options.clock,
        servo_timeout_s=options.servo_timeout,
        status_port=options.status_port,
        status_rate_hz=options.status_rate or status_stream.DEFAULT_RATE_HZ,
        rosbridge_port=options.rosbridge_port,
        rosbridge_secret=options.rosbridge_secret,
        rosbridge_origins=options.rosbridge_origin,
        rosbridge_hosts=options.rosbridge_host,
        ros=options.ros,
        ros_conventions=ros_conventions(options),
        strict=options.strict,
        exclusive=options.exclusive,
        reconnect_pause_s=options.reconnect_pause,
        backdoor_port=options.backdoor_port,
        backdoor_http_port=options.backdoor_http_port,
        backdoor_host=options.backdoor_host or LOOPBACK,
        backdoor_token=options.backdoor_token or options.backdoor_token_file,
        transcript=options.transcript,
        on_bye=ending.asked.set if options.bye_shuts_down else None,
    )
    try:
        async with simulator:
            ending.watch()
            announced = [announce(_announcement(simulator), sys.stdout)]
            if sys.stderr is not None and sys.stderr.isatty():
                banner = _banner(simulator.cell.description.name, simulator.host, simulator.ports)
                announced.append(announce(banner, sys.stderr))
            gc.freeze()  # what lives as long as the process is not searched for garbage while the robot moves
            gc.enable()
            await ending.wait(*announced)
    finally:
        gc.unfreeze()  # or Ruckig's bindings complain at exit of objects left over


def _announcement(simulator: "Simulator") -> str:
    """Where it listens, a line for each port."""
    places = {
        "listening" if name == DEFAULT_DIALECT else name: (simulator.host, port)
        for name, port in simulator.ports.items()
    }
    if simulator.status_port is not None:
        places["status"] = (simulator.host, simulator.status_port)
    if simulator.rosbridge_port is not None:
        places["rosbridge"] = (simulator.host, simulator.rosbridge_port)
    lines = [f"{what} on {host_and_port(*place)}\n" for what, place in places.items()]
    if simulator.ros_master is not None:
        lines.append(f"ROS node at {simulator.ros_master}\n")
    if simulator.backdoor_port is not None:
        lines.append(f"backdoor on {host_and_port(simulator.backdoor_host, simulator.backdoor_port)}\n")
    if simulator.backdoor_http_port is not None:
        address = host_and_port(simulator.backdoor_host, simulator.backdoor_http_port)
        lines.append(f"backdoor by HTTP on {address}\n")
    return "".join(lines)


def _banner(robot: str, host: str, ports: dict[str, int]) -> str:
    here = reached_at(host)
    ways = {
        "iiwa": "telnet {here} {port}, then type help",
        "krc4": """printf '<Cmd I0="1" I1="310"/>' | nc {here} {port}""",
    }
    first, port = next(iter(ports.items()))
    return f"{robot}, simulated. To try it: {ways[first].format(here=here, port=port)}. Ctrl-C ends it.\n"


def reached_at(host: str) -> str:
    """Where on this machine a server answers that listens on `host`."""
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # what listens everywhere listens here too


def parsed(given: Sequence[str], environment: Mapping[str, str]) -> argparse.Namespace:
    """The options for a run, of command line and environment, also those checked that hang together."""
    parser = server_parser()
    options = parser.parse_args(given)
    if options.version:
        return options
    found = read_environment(parser, environment)  # not before --help had its turn
    options = parser.parse_args(given, found)
    check_robot(parser, options)
    _check_ports(parser, options)
    if options.status_rate is not None:
        if options.status_port is None:
            parser.error("argument --status-rate: expected --status-port with it")
        if options.status_rate > options.rate:
            limit = f"the {options.rate} ticks per second of --rate"
            parser.error(f"argument --status-rate: {options.status_rate} is above {limit}")
    if options.rosbridge_secret is not None and options.rosbridge_port is None:
        parser.error("argument --rosbridge-secret: expected --rosbridge-port with it")
    for name, given in (("origin", options.rosbridge_origin), ("host", options.rosbridge_host)):
        if given and options.rosbridge_port is None:
            parser.error(f"argument --rosbridge-{name}: expected --rosbridge-port with it")
    _check_backdoor(parser, options)
    return options


def _check_backdoor(parser: Parser, options: argparse.Namespace) -> None:
    """Host and token go with a port; and other machines do without a token what they like."""
    has_port = options.backdoor_port is not None or options.backdoor_http_port is not None
    tokens = (options.backdoor_token, options.backdoor_token_file)
    for name, given in zip(("host", "token", "token-file"), (options.backdoor_host, *tokens), strict=True):
        if given is not None and not has_port:
            wanted = "expected --backdoor-port or --backdoor-http-port with it"
            parser.error(f"argument --backdoor-{name}: {wanted}")
    if None not in tokens:
        parser.error("argument --backdoor-token-file: expected no --backdoor-token with it")
    text = options.backdoor_token if options.backdoor_token is not None else options.backdoor_token_file
    try:
        check_reach(options.backdoor_host or LOOPBACK, None if text is None else Token(text))
    except ValueError as fault:
        parser.error(f"argument --backdoor-{'host' if text is None else 'token'}: {fault}")


def _check_ports(parser: Parser, options: argparse.Namespace) -> None:
    """One port for each dialect; their usual ones where none is named."""
    if options.port is None:
        options.port = [DEFAULT_PORTS[name] for name in options.dialect]
    elif options.port == [0]:
        options.port *= len(options.dialect)
    elif len(options.port) != len(options.dialect):
        wanted = f"expected {len(options.dialect)}, one for each dialect"
        parser.error(f"argument --port: {len(options.port)} given, {wanted}")


def server_parser() -> Parser:
    """With all options of the bare `iiwa-sim`."""
    # Subcommands have parsers of their own, chosen by the first argument.
    parser = Parser(
        prog="iiwa-sim",
        description="A robot controller in software that speaks the text protocol of the KUKA LBR iiwa, "
        "and the messages of a KUKA KRC4. "
        f"Other things it does, each with a --help: iiwa-sim {', '.join(SUBCOMMANDS)}",
        epilog=f"{RULE} To talk to it: telnet HOST PORT, then help",
        allow_abbrev=False,
    )
    parser.add_argument(
        "cell",
        nargs="?",
        metavar="CELL.toml",
        help="robot, start pose, tool and what stands round it (default: a robot alone)",
    )
    add_robot(parser)
    add_host(parser)
    parser.add_argument(
        "--dialect",
        type=_dialects,
        default=[DEFAULT_DIALECT],
        metavar="NAME[,NAME]",
        help=f"what is spoken, {' or '.join(DEFAULT_PORTS)}; with several each has its port "
        f"(default: {DEFAULT_DIALECT})",
    )
    usual = ", ".join(f"{port} for {name}" for name, port in DEFAULT_PORTS.items())
    parser.add_argument(
        "--port",
        type=_ports,
        metavar="PORT[,PORT]",
        help=f"port to listen on, one for each dialect; 0 picks one (default: {usual})",
    )
    add_rate(parser)
    parser.add_argument(
        "--clock",
        type=_pace,
        default=REAL,
        metavar="real|10x|fast|stepped",
        help=f"how simulated time passes: in real time, {MIN_SPEED:g} to {MAX_SPEED:g} times as fast, as "
        "fast as it can while the robot is under way, or only when told (default: real)",
    )
    parser.add_argument(
        "--servo-timeout",
        type=_seconds(LONGEST_SERVO_TIMEOUT_S),
        metavar="SECONDS",
        help="stop the robot when a smart or direct move is not followed by another for so long, above 0 and "
        f"up to {LONGEST_SERVO_TIMEOUT_S:g} (default: never)",
    )
    parser.add_argument(
        "--status-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="broadcast the robot's state there, as lines of JSON, and take the line 'stop'; 0 picks a port "
        "(default: no such port)",
    )
    low_hz, high_hz = status_stream.MIN_RATE_HZ, status_stream.MAX_RATE_HZ
    parser.add_argument(
        "--status-rate",
        type=whole(low_hz, high_hz),
        metavar="HZ",
        help=f"lines per second on that port, {low_hz} to {high_hz}, and not above the --rate "
        f"(default: {status_stream.DEFAULT_RATE_HZ})",
    )
    add_rosbridge(parser)
    add_ros(parser)
    add_ros_conventions(parser)
    parser.add_argument(
        "--backdoor-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="on this port, take the commands of a test bench: faults, pushes, and more; 0 picks a port "
        "(default: no such port)",
    )
    parser.add_argument(
        "--backdoor-http-port",
        type=whole(0, MAX_PORT),
        metavar="PORT",
        help="the same as JSON over HTTP, as POST /backdoor/emergency-stop, with GET /state, /dialogue, "
        "/healthz, /openapi.json; 0 picks a port (default: no such port)",
    )
    parser.add_argument(
        "--backdoor-host",
        metavar="HOST",
        help="address on which these two listen; one that other machines reach, such as 0.0.0.0, takes a "
        f"token (default: {LOOPBACK})",
    )
    parser.add_argument(
        "--backdoor-token",
        metavar="TOKEN",
        help="take only who knows it: the first line of a connection, 'Authorization: Bearer TOKEN' over "
        "HTTP. The command line shows it to others on this machine (default: all)",
    )
    parser.add_argument(
        "--backdoor-token-file",
        type=secret_in,
        metavar="FILE",
        help="the same, with the token in this file",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="answer error to a line with more values than its command takes (default: they are ignored, as "
        "by the original, with a warning in the log)",
    )
    parser.add_argument(
        "--exclusive",
        action="store_true",
        help="serve one client after the other: who connects meanwhile waits (default: all at once)",
    )
    parser.add_argument(
        "--reconnect-pause",
        type=_seconds(LONGEST_PAUSE_S, or_zero=True),
        default=0.0,
        metavar="SECONDS",
        help="after the last client has gone, serve the next one so much later, up to "
        f"{LONGEST_PAUSE_S:g} (default: 0)",
    )
    parser.add_argument(
        "--transcript",
        type=Path,
        metavar="FILE",
        help=f"write down there what is said in all dialects; iiwa-sim {REPLAY} plays it",
    )
    parser.add_argument("--bye-shuts-down", action="store_true", help="end when a client says bye")
    add_log(parser)
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    return parser


def _ports(text: str) -> list[int]:
    port = whole(0, MAX_PORT)
    return [port(each) for each in text.split(",")]


def _dialects(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in DEFAULT_PORTS or names.count(name) > 1:
            known = " or ".join(DEFAULT_PORTS)
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown}: expected {known}, each at most once, a comma between")
    return names


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
