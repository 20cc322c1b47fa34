"""`iiwa-sim` and plot, check-cell, replay, check and bridge: options, messages and exit codes.

Exit code 0 after SIGTERM or SIGINT, a bye that is to end it, when the picture is written, the cell is right
or a server answers as expected; 1 where it does not; 2, with one line on stderr, for options, a cell, a
robot, an address, a stdout or a file it cannot use, and for commands of a picture that are refused.
"""

import argparse
import asyncio
import contextlib
import gc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import NoReturn

from iiwa_sim import log
from iiwa_sim.bridge.fault import BridgeFault
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.clock.clock import DEFAULT_RATE_HZ, MAX_RATE_HZ, MIN_RATE_HZ
from iiwa_sim.clock.pace import EXPECTED, MAX_SPEED, MIN_SPEED, REAL, Pace, pace
from iiwa_sim.controller.modes import LONGEST_SERVO_TIMEOUT_S
from iiwa_sim.dialect.decimals import parse_decimal
from iiwa_sim.dialect.ports import DEFAULT_DIALECT, DEFAULT_PORTS
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.robot.description import DEFAULT_ROBOT, RobotFault, built_in_robots
from iiwa_sim.ros.fault import RosFault
from iiwa_sim.serve import status_stream
from iiwa_sim.serve.listening import MAX_PORT, ListenFault, host_and_port, why
from iiwa_sim.serve.turns import LONGEST_PAUSE_S
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.wording import harmless, shortened

PLOT = "plot"
CHECK_CELL = "check-cell"
REPLAY = "replay"
CHECK = "check"
BRIDGE = "bridge"
ROSBRIDGE_PORT = 9090
PICTURES = (".png", ".svg")
LONGEST_MESSAGE = 400
"""Characters of a message about wrong arguments, which cites them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGTERM or SIGINT, or what a subcommand asks for; returns the exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        if given and given[0] == PLOT:
            return _plot(_plot_options(given[1:]))
        if given and given[0] == CHECK_CELL:
            return _check_cell(_check_cell_parser().parse_args(given[1:]))
        if given and given[0] == REPLAY:
            return _replay(_replay_parser().parse_args(given[1:]))
        if given and given[0] == CHECK:
            return _check(_check_parser().parse_args(given[1:]))
        if given and given[0] == BRIDGE:
            return _bridge(_bridge_parser().parse_args(given[1:]))
        return _run(_options(given))
    except (
        BridgeFault,
        CellFault,
        RobotFault,
        ListenFault,
        PlotFault,
        RosFault,
        TranscriptFault,
        _StdoutFault,
    ) as fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # in a subcommand
        return 128 + signal.SIGINT


def _run(options: argparse.Namespace) -> int:
    if options.version:
        _say(f"iiwa-sim {metadata.version('iiwa-sim')}\n")
        return 0
    ending = _Ending()
    if sys.stderr is not None:
        log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    gc.disable()  # nothing made during the start is garbage
    asyncio.run(_serve(options, ending))
    return 0


async def _serve(options: argparse.Namespace, ending: "_Ending") -> None:
    # Pinocchio and Ruckig take their time to load: not before the options are known to be right.
    from iiwa_sim.simulator import LOOPBACK, Simulator

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
        exclusive=options.exclusive,
        reconnect_pause_s=options.reconnect_pause,
        backdoor_port=options.backdoor_port,
        on_bye=ending.asked.set if options.bye_shuts_down else None,
    )
    async with simulator:
        ending.watch()
        recorder: contextlib.AbstractContextManager[object] = contextlib.nullcontext()
        if options.transcript is not None:
            from iiwa_sim.transcript.record import Recorder

            title = f"{simulator.cell.description.name}, recorded by iiwa-sim {metadata.version('iiwa-sim')}"
            recorder = Recorder(options.transcript, simulator.dialogue, 1.0 / options.rate, title)
        for port in simulator.ports.values():
            _say(f"listening on {host_and_port(simulator.host, port)}\n")
        if simulator.status_port is not None:
            _say(f"status on {host_and_port(simulator.host, simulator.status_port)}\n")
        if simulator.rosbridge_port is not None:
            _say(f"rosbridge on {host_and_port(simulator.host, simulator.rosbridge_port)}\n")
        if simulator.backdoor_port is not None:
            _say(f"backdoor on {host_and_port(LOOPBACK, simulator.backdoor_port)}\n")
        if sys.stderr is not None and sys.stderr.isatty():
            print(_banner(simulator.cell.description.name, simulator.host, simulator.ports), file=sys.stderr)
        gc.freeze()  # what lives as long as the process is not searched for garbage while the robot moves
        gc.enable()
        with recorder:
            await ending.asked.wait()
    gc.unfreeze()  # or Ruckig's bindings complain at exit of objects left over


def _plot(options: argparse.Namespace) -> int:
    try:
        from iiwa_sim.plot.draw import picture
    except ModuleNotFoundError as fault:
        if not (fault.name or "").startswith("matplotlib"):
            raise
        raise PlotFault("a picture needs matplotlib: pip install 'iiwa-sim[plot]'") from None
    from iiwa_sim.cell.cell import load_cell, robot_alone
    from iiwa_sim.plot.record import record
    from iiwa_sim.plot.script import read_script

    output: Path = options.output
    if options.cell is None:
        cell = robot_alone(DEFAULT_ROBOT if options.robot is None else options.robot)
    else:
        cell = load_cell(options.cell)
    recording = record(read_script(options.commands), cell, options.rate)
    drawn = picture(recording, output.suffix[1:].lower())
    try:
        output.write_bytes(drawn)
    except OSError as fault:
        raise PlotFault(f"{output}: cannot be written: {fault.strerror}") from None
    return 0


def _check_cell(options: argparse.Namespace) -> int:
    from iiwa_sim.cell.cell import load_cell
    from iiwa_sim.cell.summary import summary
    from iiwa_sim.dialect.dialects import fitting_dialects
    from iiwa_sim.simulator import Simulator

    dialects = fitting_dialects(load_cell(options.cell).description)
    _say(summary(Simulator(cell=options.cell, dialects=dialects).cell))  # all but listening
    return 0


def _replay(options: argparse.Namespace) -> int:
    from iiwa_sim.transcript.lines import read_file
    from iiwa_sim.transcript.replay import replay

    transcript = read_file(options.transcript)
    deviations = 0
    for deviation in replay(transcript, *options.server):
        deviations += 1
        _say(harmless(f"{transcript.name}:{deviation.line}: {deviation}") + "\n")
    _say(f"{deviations} deviation{'' if deviations == 1 else 's'} in {len(transcript.steps)} lines\n")
    return 1 if deviations else 0


def _check(options: argparse.Namespace) -> int:
    from iiwa_sim.check import report
    from iiwa_sim.check.check import check
    from iiwa_sim.check.findings import Finding, Verdict
    from iiwa_sim.check.link import Link

    host, port = options.server
    link = Link(host, port, options.allow_motion)
    findings: list[Finding] = []
    for probe, finding in check(link):
        if not findings:
            _say(f"{report.HEAD}\n")
        findings.append(finding)
        _say(report.line(probe, finding) + "\n")
    _say(report.summary(findings, link.sent) + "\n")
    return 1 if any(finding.verdict is Verdict.DEVIATION for finding in findings) else 0


def _bridge(options: argparse.Namespace) -> int:
    ending = _Ending()
    if sys.stderr is not None:
        log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    asyncio.run(_serve_bridge(options, ending))
    return 0


async def _serve_bridge(options: argparse.Namespace, ending: "_Ending") -> None:
    from iiwa_sim.bridge.bridge import Bridge
    from iiwa_sim.robot.description import load_robot

    bridge = Bridge(
        options.server,
        load_robot(DEFAULT_ROBOT if options.robot is None else options.robot),
        host=options.host,
        rosbridge_port=options.rosbridge_port,
        rosbridge_secret=options.rosbridge_secret,
    )
    async with bridge:
        ending.watch()
        _say(f"rosbridge on {host_and_port(*bridge.rosbridge_address)}\n")
        await ending.asked.wait()


class _StdoutFault(Exception):
    """A stdout that takes nothing. The message is one line."""


def _say(text: str) -> None:
    """Write to stdout at once. Raises `_StdoutFault`."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as fault:
        # What is left in the buffer is tried again at exit, and would be complained of a second time.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
        raise _StdoutFault(f"cannot write to stdout: {fault.strerror}") from None


class _Ending:
    """SIGTERM and SIGINT end in good order; process 1 of a container has no default for them."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._signalled)

    def watch(self) -> None:
        """From now on, set `asked` instead of leaving at once. To be called inside the loop."""
        self._loop = asyncio.get_running_loop()

    def _signalled(self, *_: object) -> None:
        if self._loop is None:
            sys.exit(0)
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self.asked.set)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        told = shortened(harmless(message), LONGEST_MESSAGE)
        self.exit(2, f"{self.prog}: {told} (see {self.prog} --help)\n")

    def print_help(self, _file: object = None) -> None:
        _say(self.format_help())


def _options(given: Sequence[str]) -> argparse.Namespace:
    """The options for a run, also those checked that hang together."""
    parser = _parser()
    options = parser.parse_args(given)
    _check_robot(parser, options)
    _check_ports(parser, options)
    if options.status_rate is not None:
        if options.status_port is None:
            parser.error("argument --status-rate: expected --status-port with it")
        if options.status_rate > options.rate:
            limit = f"the {options.rate} ticks per second of --rate"
            parser.error(f"argument --status-rate: {options.status_rate} is above {limit}")
    if options.rosbridge_secret is not None and options.rosbridge_port is None:
        parser.error("argument --rosbridge-secret: expected --rosbridge-port with it")
    return options


def _plot_options(given: Sequence[str]) -> argparse.Namespace:
    parser = _plot_parser()
    options = parser.parse_args(given)
    _check_robot(parser, options)
    return options


def _check_ports(parser: _Parser, options: argparse.Namespace) -> None:
    """One port for each dialect; their usual ones where none is named."""
    if options.port is None:
        options.port = [DEFAULT_PORTS[name] for name in options.dialect]
    elif options.port == [0]:
        options.port *= len(options.dialect)
    elif len(options.port) != len(options.dialect):
        wanted = f"expected {len(options.dialect)}, one for each dialect"
        parser.error(f"argument --port: {len(options.port)} given, {wanted}")


def _check_robot(parser: _Parser, options: argparse.Namespace) -> None:
    if options.cell is not None and options.robot is not None:
        parser.error("argument --robot: expected no cell with it, which names its robot")


def _parser() -> _Parser:
    # Subcommands have parsers of their own, chosen by the first argument.
    parser = _Parser(
        prog="iiwa-sim",
        description="A robot controller in software that speaks the text protocol of the KUKA LBR iiwa, "
        "and the messages of a KUKA KRC4. "
        f"To draw a motion instead: iiwa-sim {PLOT} --help. To check a cell: iiwa-sim {CHECK_CELL}. "
        f"Against a server: iiwa-sim {REPLAY}, iiwa-sim {CHECK}",
        epilog="To talk to it: telnet HOST PORT, then help",
        allow_abbrev=False,
    )
    parser.add_argument(
        "cell",
        nargs="?",
        metavar="CELL.toml",
        help="robot, start pose, tool and what stands round it (default: a robot alone)",
    )
    _add_robot(parser)
    _add_host(parser)
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
    _add_rate(parser)
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
        type=_whole(0, MAX_PORT),
        metavar="PORT",
        help="broadcast the robot's state there, as lines of JSON, and take the line 'stop'; 0 picks a port "
        "(default: no such port)",
    )
    low_hz, high_hz = status_stream.MIN_RATE_HZ, status_stream.MAX_RATE_HZ
    parser.add_argument(
        "--status-rate",
        type=_whole(low_hz, high_hz),
        metavar="HZ",
        help=f"lines per second on that port, {low_hz} to {high_hz}, and not above the --rate "
        f"(default: {status_stream.DEFAULT_RATE_HZ})",
    )
    _add_rosbridge(parser)
    parser.add_argument(
        "--backdoor-port",
        type=_whole(0, MAX_PORT),
        metavar="PORT",
        help="on this port of 127.0.0.1, take the commands of a test bench: faults, pushes, and more; 0 "
        "picks a port (default: no such port)",
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
        help=f"write down there what is said on the main port; iiwa-sim {REPLAY} plays it",
    )
    parser.add_argument("--bye-shuts-down", action="store_true", help="end when a client says bye")
    _add_log(parser)
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    return parser


def _plot_parser() -> _Parser:
    parser = _Parser(
        prog=f"iiwa-sim {PLOT}",
        description="Runs a file of commands in simulated time and draws the motion: positions, velocities "
        "and accelerations of the joints, speed and way of the TCP, with targets and blending spheres, and "
        "the forces at the TCP with the thresholds of force moves, where there are any.",
        epilog="In the file: one command per line as on the wire, besides 'wait SECONDS' and 'wait stopped'; "
        "what follows a # is a comment.",
        allow_abbrev=False,
    )
    parser.add_argument("commands", metavar="COMMANDS", help="the file")
    parser.add_argument(
        "-o", "--output", type=_picture, required=True, metavar="PICTURE", help="where to, as .png or .svg"
    )
    parser.add_argument(
        "--cell",
        metavar="CELL.toml",
        help="robot, start pose, tool and what stands round it (default: a robot alone)",
    )
    _add_robot(parser)
    _add_rate(parser)
    return parser


def _check_cell_parser() -> _Parser:
    parser = _Parser(
        prog=f"iiwa-sim {CHECK_CELL}",
        description="Says what is in a cell, or what is wrong in it.",
        allow_abbrev=False,
    )
    parser.add_argument("cell", metavar="CELL.toml", help="the file")
    return parser


def _replay_parser() -> _Parser:
    parser = _Parser(
        prog=f"iiwa-sim {REPLAY}",
        description="Plays a transcript against a server and tells which lines are answered otherwise.",
        epilog="Exit code 0 if there are none, 1 if there are some, 2 if it cannot be played.",
        allow_abbrev=False,
    )
    parser.add_argument("transcript", type=Path, metavar="FILE", help="as --transcript records it")
    _add_server(parser)
    return parser


def _check_parser() -> _Parser:
    parser = _Parser(
        prog=f"iiwa-sim {CHECK}",
        description="Tells what a server does otherwise than the original one of this protocol. Sends hello, "
        "help, stop, bye, lines that are no commands, and commands that begin with get or is, which move "
        "nothing. The robot has to be at rest.",
        epilog="Exit code 0 if nothing deviates, 1 if something does, 2 without a server, or with a robot "
        "that moves.",
        allow_abbrev=False,
    )
    _add_server(parser)
    parser.add_argument(
        "--allow-motion",
        action="store_true",
        help="also send moves, from where the robot is and back: up to 40 mm upwards, 0.1 rad of A7, 0.03 "
        "rad of A3 with the TCP held, at up to a fifth of the speed",
    )
    return parser


def _bridge_parser() -> _Parser:
    parser = _Parser(
        prog=f"iiwa-sim {BRIDGE}",
        description="Puts a robot on ROS: be the driver of a server of the iiwa's text protocol, emulated or "
        "real, and give it the topics and services of drag&bot, by rosbridge.",
        allow_abbrev=False,
    )
    _add_server(parser)
    _add_robot(parser)
    _add_host(parser)
    _add_rosbridge(parser, ROSBRIDGE_PORT)
    _add_log(parser)
    return parser


def _add_server(parser: _Parser) -> None:
    parser.add_argument("server", type=_server, metavar="HOST:PORT", help="where it listens")


def _server(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not host or not (port.isascii() and port.isdigit() and len(port) < 6 and 1 <= int(port) <= MAX_PORT):
        raise argparse.ArgumentTypeError(f"{shortened(repr(text), 40)} is not HOST:PORT")
    return host, int(port)


def _add_robot(parser: _Parser) -> None:
    parser.add_argument(
        "--robot",
        metavar="NAME|FOLDER",
        help=f"{', '.join(built_in_robots())}, or your own (default: {DEFAULT_ROBOT})",
    )


def _add_host(parser: _Parser) -> None:
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on; 0.0.0.0 for all (default: %(default)s)"
    )


def _add_log(parser: _Parser) -> None:
    parser.add_argument(
        "--log-level",
        choices=log.LEVELS,
        default=log.DEFAULT_LEVEL,
        help="error: faults of the simulator; warning: also refused commands, clients that vanish while "
        "the robot moves, servo timeouts and forces that end a move; info: also clients that come and go; "
        "debug: also every command (default: %(default)s)",
    )
    parser.add_argument("--log-json", action="store_true", help="log JSON, one object per line")


def _add_rosbridge(parser: _Parser, port: int | None = None) -> None:
    parser.add_argument(
        "--rosbridge-port",
        type=_whole(0, MAX_PORT),
        metavar="PORT",
        default=port,
        help="be a ROS node with drag&bot's topics and services there, by rosbridge; 0 picks a port, "
        f"{ROSBRIDGE_PORT} is usual (default: {'no such port' if port is None else port})",
    )
    parser.add_argument(
        "--rosbridge-secret",
        type=_secret,
        metavar="FILE",
        help="take only clients of rosbridge that know the secret in this file (default: all)",
    )


def _add_rate(parser: _Parser) -> None:
    parser.add_argument(
        "--rate",
        type=_whole(MIN_RATE_HZ, MAX_RATE_HZ),
        default=DEFAULT_RATE_HZ,
        metavar="HZ",
        help=f"ticks per second, {MIN_RATE_HZ} to {MAX_RATE_HZ} (default: %(default)s)",
    )


def _pace(text: str) -> Pace:
    try:
        return pace(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{shortened(repr(text), 40)} is not {EXPECTED}") from None


def _picture(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in PICTURES:
        shown = shortened(repr(text), 40)
        raise argparse.ArgumentTypeError(f"{shown} does not end in {' or '.join(PICTURES)}")
    return path


def _secret(path: str) -> str:
    shown = shortened(repr(path), 40)
    try:
        secret = Path(path).read_text(encoding="utf-8").strip()
    except (OSError, ValueError) as fault:
        raise argparse.ArgumentTypeError(f"{shown} cannot be read: {why(fault)}") from None
    if not secret:
        raise argparse.ArgumentTypeError(f"{shown} is empty, expected a secret")
    return secret


def _whole(low: int, high: int) -> Callable[[str], int]:
    def whole_number(text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 10 and low <= int(text) <= high):
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown} is not a whole number from {low} to {high}")
        return int(text)

    return whole_number


def _ports(text: str) -> list[int]:
    port = _whole(0, MAX_PORT)
    return [port(each) for each in text.split(",")]


def _dialects(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in DEFAULT_PORTS or names.count(name) > 1:
            known = " or ".join(DEFAULT_PORTS)
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown}: expected {known}, each at most once, a comma between")
    return names


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


def _banner(robot: str, host: str, ports: dict[str, int]) -> str:
    here = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # what listens everywhere listens here too
    ways = {
        "iiwa": "telnet {here} {port}, then type help",
        "krc4": """printf '<Cmd I0="1" I1="310"/>' | nc {here} {port}""",
    }
    first, port = next(iter(ports.items()))
    return f"{robot}, simulated. To try it: {ways[first].format(here=here, port=port)}. Ctrl-C ends it."
