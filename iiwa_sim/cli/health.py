"""Whether an iiwa-sim that runs as another process answers in all its protocols.

A container is checked every few seconds, so this imports the standard library and the options only.
"""

import socket
from pathlib import Path

from iiwa_sim.cli.output import reached_at
from iiwa_sim.cli.parsing import from_command_line
from iiwa_sim.options.robots import robots_of
from iiwa_sim.options.sources import from_environment, merged

TIMEOUT_S = 2.0
"""Seconds for each protocol: a check of two protocols ends before Docker's limit of 5 s."""
_LONGEST_ANSWER = 4096
_PROGRAMS = ("iiwa-sim", "iiwa_sim")  # the script, and what follows python -m
_ASK = {
    "iiwa": (b"hello\r\n", b"hello", b"\n"),
    "krc4": (b'<Cmd I0="1" I1="100"/>', b"<Res", b"</Res>"),  # FIN
}
"""What is sent, and how the answer begins and ends."""


def fault_of(process: int) -> str:
    """Return what is wrong with a process; empty if nothing is. Of several robots it asks two."""
    try:
        words, environment = (
            Path(f"/proc/{process}/{what}").read_text(errors="surrogateescape").split("\0")[:-1]
            for what in ("cmdline", "environ")
        )
    except OSError as fault:
        return f"command line and environment of process {process} cannot be read: {fault.strerror}"
    place = next((i for i, word in enumerate(words) if Path(word).name in _PROGRAMS), None)
    if place is None:
        return f"process {process} is no iiwa-sim"
    variables = {name: value for name, _, value in (each.partition("=") for each in environment)}
    robots = robots_of(merged(from_environment(variables)[0], from_command_line(words[place + 1 :])))
    for name, settings in robots if len(robots) == 1 else (robots[0], robots[-1]):
        for protocol, port in zip(settings.protocol, settings.port, strict=True):
            what = f"{name} {protocol}".lstrip()
            if port == 0:
                return f"process {process} picks a port for {what}: only its first lines tell which"
            host = reached_at(settings.host)
            unanswered = _unanswered(host, port, *_ASK[protocol])
            if unanswered:
                return f"{what} on {f'[{host}]' if ':' in host else host}:{port}: {unanswered}"
    return ""


def _unanswered(host: str, port: int, asked: bytes, begins: bytes, ends: bytes) -> str:
    """Return why there is no answer; empty if there is one."""
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
