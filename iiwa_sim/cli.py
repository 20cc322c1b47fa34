"""`iiwa-sim`: its options, its messages, its exit codes.

Exit code 0 after SIGTERM or SIGINT; 2, with one line on stderr, for options, a robot, an address or a stdout
it cannot use.
"""

import argparse
import asyncio
import gc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import metadata
from typing import NoReturn

from iiwa_sim import log
from iiwa_sim.clock import DEFAULT_RATE_HZ, MAX_RATE_HZ, MIN_RATE_HZ
from iiwa_sim.robot.description import DEFAULT_ROBOT, RobotFault, built_in_robots
from iiwa_sim.serve.tcp import MAX_PORT, ListenFault, host_and_port
from iiwa_sim.wording import harmless, shortened

PORT = 30000
LONGEST_MESSAGE = 400
"""Characters of a message about wrong arguments, which cites them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGTERM or SIGINT; returns the exit code."""
    try:
        return _run(_parser().parse_args(arguments))
    except (RobotFault, ListenFault, _StdoutFault) as fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
        return 2


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
    from iiwa_sim.simulator import Simulator

    simulator = Simulator(options.robot, host=options.host, port=options.port, rate_hz=options.rate)
    async with simulator:
        ending.watch()
        _say(f"listening on {host_and_port(simulator.host, simulator.port)}\n")
        if sys.stderr is not None and sys.stderr.isatty():
            print(_banner(simulator.description.name, simulator.host, simulator.port), file=sys.stderr)
        gc.freeze()  # what lives as long as the process is not searched for garbage while the robot moves
        gc.enable()
        await ending.asked.wait()
    gc.unfreeze()  # or Ruckig's bindings complain at exit of objects left over


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


def _parser() -> _Parser:
    # Subcommands to come get parsers of their own, chosen by the first argument.
    parser = _Parser(
        prog="iiwa-sim",
        description="A robot controller in software that speaks the text protocol of the KUKA LBR iiwa.",
        epilog="To talk to it: telnet HOST PORT, then help",
        allow_abbrev=False,
    )
    names = ", ".join(built_in_robots())
    parser.add_argument(
        "--robot",
        default=DEFAULT_ROBOT,
        metavar="NAME|FOLDER",
        help=f"{names}, or your own (default: %(default)s)",
    )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on; 0.0.0.0 for all (default: %(default)s)"
    )
    parser.add_argument(
        "--port",
        type=_whole(0, MAX_PORT),
        default=PORT,
        help="port to listen on; 0 picks one (default: %(default)s)",
    )
    parser.add_argument(
        "--rate",
        type=_whole(MIN_RATE_HZ, MAX_RATE_HZ),
        default=DEFAULT_RATE_HZ,
        metavar="HZ",
        help=f"ticks per second, {MIN_RATE_HZ} to {MAX_RATE_HZ} (default: %(default)s)",
    )
    parser.add_argument(
        "--log-level",
        choices=log.LEVELS,
        default=log.DEFAULT_LEVEL,
        help="error: faults of the simulator; warning: also refused commands, and clients that vanish while "
        "the robot moves; info: also clients that come and go; debug: also every command "
        "(default: %(default)s)",
    )
    parser.add_argument("--log-json", action="store_true", help="log JSON, one object per line")
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    return parser


def _whole(low: int, high: int) -> Callable[[str], int]:
    def whole_number(text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 10 and low <= int(text) <= high):
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown} is not a whole number from {low} to {high}")
        return int(text)

    return whole_number


def _banner(robot: str, host: str, port: int) -> str:
    here = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # what listens everywhere listens here too
    return f"{robot}, simulated. To try it: telnet {here} {port}, then type help. Ctrl-C ends it."
