"""Health check: ask an iiwa-sim in another process in all its protocols.

A container is checked every few seconds, so this imports the standard library and the options only.
"""

from pathlib import Path

from iiwa_sim.cli.parsing import from_command_line, reached_at
from iiwa_sim.client import Iiwa, Krc4, ReplyError
from iiwa_sim.options.robots import robots_in, robots_of
from iiwa_sim.options.sources import from_environment, merged
from iiwa_sim.protocols.ports import IIWA

TIMEOUT_S = 2.0
"""Seconds for each protocol: a check of two protocols ends before Docker's limit of 5 s."""
_PROGRAMS = ("iiwa-sim", "iiwa_sim")  # the script, and what follows python -m


def fault_of(process: int) -> str:
    """Return what is wrong with a process; empty if nothing is. Of several robots it asks the first."""
    try:
        words, environment = (
            Path(f"/proc/{process}/{what}").read_text(errors="surrogateescape").split("\0")[:-1]
            for what in ("cmdline", "environ")
        )
    except OSError as fault:
        return f"command line and environment of process {process} cannot be read: {fault.strerror}"
    variables = dict(each.partition("=")[::2] for each in environment)
    place = next((i for i, word in enumerate(words, 1) if Path(word).name in _PROGRAMS), len(words))
    robots = robots_of(merged(from_environment(variables)[0], from_command_line(words[place:])))
    name, settings = next(iter(robots.items()))
    for robot, ports in (robots_in(settings) or {"": settings.ports}).items():
        for protocol, port in ports.items():
            what = " ".join(filter(None, (name, robot, protocol)))
            if port == 0:
                return f"process {process} picks a port for {what}: only its first lines tell which"
            address = reached_at(settings.host), port, TIMEOUT_S
            try:
                with Iiwa(*address) if protocol == IIWA else Krc4(*address) as client:
                    client.hello() if isinstance(client, Iiwa) else client.fin()
            except (OSError, ReplyError) as fault:
                return f"{what} on port {port}: {fault}"
    return ""
