"""`iiwa-sim health`: whether an iiwa-sim that runs as process 1, as in a container, answers all its dialects.

Which they are, and on which ports, its command line and environment tell. It is asked there as by any client.
Exit code 0 if it answers, 1 with one line if it does not.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from iiwa_sim.cli import server_options
from iiwa_sim.cli.addresses import reached_at
from iiwa_sim.cli.names import HEALTH
from iiwa_sim.cli.parsing import Parser, whole
from iiwa_sim.client import CommandError, Iiwa, Krc4, ReplyError
from iiwa_sim.dialect.ports import IIWA, KRC4
from iiwa_sim.serve.listening import host_and_port, why

TIMEOUT_S = 2.0
"""For each dialect: so a check of two ends before Docker, which grants it 5 s, ends it without a word."""

_LARGEST_PROCESS = 2**22  # of Linux
_PROGRAMS = ("iiwa-sim", "iiwa_sim")  # the script, and what comes behind python -m


def _ask_iiwa(host: str, port: int) -> None:
    with Iiwa(host, port, TIMEOUT_S) as robot:
        robot.hello()


def _ask_krc4(host: str, port: int) -> None:
    with Krc4(host, port, TIMEOUT_S) as robot:
        robot.fin()


_ASK: dict[str, Callable[[str, int], None]] = {IIWA: _ask_iiwa, KRC4: _ask_krc4}


def run(given: Sequence[str]) -> int:
    process = _parser().parse_args(given).process
    fault = _fault(process)
    if fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
    return 1 if fault else 0


def _fault(process: int) -> str:
    """What is wrong with it; empty if nothing is."""
    try:
        words = _listed(process, "cmdline")
        environment = _listed(process, "environ")
    except OSError as fault:
        return f"command line and environment of process {process} cannot be read: {why(fault)}"
    place = next((i for i, word in enumerate(words) if Path(word).name in _PROGRAMS), None)
    if place is None:
        return f"process {process} is no iiwa-sim"
    variables = (variable.partition("=") for variable in environment)
    options = server_options.parsed(words[place + 1 :], {name: value for name, _, value in variables})
    for dialect, port in zip(options.dialect, options.port, strict=True):
        if port == 0:
            return f"process {process} was told to pick a port for {dialect}: only its first lines tell which"
        host = reached_at(options.host)
        try:
            _ASK[dialect](host, port)
        except (OSError, CommandError, ReplyError) as fault:
            return f"{dialect} on {host_and_port(host, port)}: {fault}"
    return ""


def _listed(process: int, what: str) -> list[str]:
    return Path(f"/proc/{process}/{what}").read_text(errors="surrogateescape").split("\0")[:-1]


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {HEALTH}",
        description="Tells by its exit code whether an iiwa-sim on this machine answers all its dialects, on "
        "the ports that its command line and environment name; for health checks of containers.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "process",
        nargs="?",
        type=whole(1, _LARGEST_PROCESS),
        default=1,
        metavar="PROCESS",
        help="its number (default: 1, the first of a container)",
    )
    return parser
