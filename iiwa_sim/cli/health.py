"""`iiwa-sim health`: whether the iiwa-sim that runs as process 1, as in a container, answers in all its
dialects.

Its command line and environment tell the dialects and ports. Each port is asked as by any client; of several
robots the first and the last are asked. Exit code 0 if all answer, 1 with one line otherwise.

A container is checked every few seconds, so nothing is imported but the standard library and a few small
modules.
"""

import argparse
import socket
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from iiwa_sim.cli.addresses import add_addresses, reached_at, settle_ports
from iiwa_sim.cli.environment import read_environment
from iiwa_sim.cli.names import HEALTH
from iiwa_sim.cli.parsing import Parser, whole
from iiwa_sim.dialect.ports import IIWA, KRC4

TIMEOUT_S = 2.0
"""Seconds for each dialect: a check of two dialects ends before Docker's limit of 5 s."""

_LARGEST_PROCESS = 2**22  # of Linux
_LONGEST_ANSWER = 4096
_PROGRAMS = ("iiwa-sim", "iiwa_sim")  # the script, and what follows python -m
_ASK = {
    IIWA: (b"hello\r\n", b"hello", b"\n"),
    KRC4: (b'<Cmd I0="1" I1="100"/>', b"<Res", b"</Res>"),  # FIN
}
"""What is sent, and how the answer begins and ends."""


def run(given: Sequence[str]) -> int:
    process = _parser().parse_args(given).process
    fault = _fault(process)
    if fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
    return 1 if fault else 0


def _fault(process: int) -> str:
    """What is wrong with the process; empty if nothing is."""
    try:
        words = _listed(process, "cmdline")
        environment = _listed(process, "environ")
    except OSError as fault:
        return f"command line and environment of process {process} cannot be read: {fault.strerror}"
    place = next((i for i, word in enumerate(words) if Path(word).name in _PROGRAMS), None)
    if place is None:
        return f"process {process} is no iiwa-sim"
    given = words[place + 1 :]
    variables = (variable.partition("=") for variable in environment)
    for robot, options in _robots(given, {name: value for name, _, value in variables}):
        for dialect, port in zip(options.dialect, options.port, strict=True):
            what = f"{robot} {dialect}".lstrip()
            if port == 0:
                told = "only its first lines tell which"
                return f"process {process} was told to pick a port for {what}: {told}"
            host = reached_at(options.host)
            unanswered = _unanswered(host, port, *_ASK[dialect])
            if unanswered:
                return f"{what} on {_shown(host, port)}: {unanswered}"
    return ""


def _robots(given: Sequence[str], environment: dict[str, str]) -> Iterator[tuple[str, argparse.Namespace]]:
    """Names and options of the robots to ask: a single one, or the first and the last."""
    parser = Parser(prog="iiwa-sim")
    add_addresses(parser)
    options, _ = parser.parse_known_args(given, read_environment(parser, environment))
    if options.fleet is None:
        settle_ports(parser.error, options)
        yield "" if options.count is None else "robot-0", options
        last = (options.count or 1) - 1
        if last:
            options.port = [port and port + last for port in options.port]
            yield f"robot-{last}", options
        return
    # Only a fleet of different robots needs more modules than these few.
    from iiwa_sim.cli.fleet import robots_of
    from iiwa_sim.cli.server_options import parsed, server_parser

    robots = robots_of(server_parser(), parsed(given, environment))
    yield from robots if len(robots) == 1 else (robots[0], robots[-1])


def _unanswered(host: str, port: int, asked: bytes, begins: bytes, ends: bytes) -> str:
    """Why there is no answer; empty if there is one."""
    answer = b""
    try:
        with socket.create_connection((host, port), TIMEOUT_S) as connection:
            connection.sendall(asked)
            while ends not in answer and len(answer) < _LONGEST_ANSWER:
                more = connection.recv(_LONGEST_ANSWER)
                if not more:
                    return "the connection ended before the answer"
                answer += more
    except OSError as fault:
        return str(fault)
    return "" if answer.startswith(begins) else f"an answer of something else: {answer[:40]!r}"


def _shown(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _listed(process: int, what: str) -> list[str]:
    return Path(f"/proc/{process}/{what}").read_text(errors="surrogateescape").split("\0")[:-1]


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {HEALTH}",
        description="Tells by its exit code whether an iiwa-sim on this machine answers all its dialects, on "
        "the ports that its command line and environment name; for health checks of containers.",
        examples={"": "asks process 1, as the health check of a container does"},
    )
    parser.add_argument(
        "process",
        nargs="?",
        type=whole(1, _LARGEST_PROCESS),
        default=1,
        metavar="PROCESS",
        help="number of the process (default: 1, the first of a container)",
    )
    return parser
