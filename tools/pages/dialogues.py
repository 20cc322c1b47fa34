"""Dialogues for the pages of commands: those of protocol/transcripts, held when the site is built.

The transcripts are patterns that hold for any pose; what stands in a page was really said and answered.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

from iiwa_sim.dialect.wire.error_codes import load_error_codes
from iiwa_sim.remembered import Exchange
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Answered, Said, Transcript, command_of, shipped
from iiwa_sim.transcript.replay import replay

REFUSED = ("error", "unknown command")
EXTENSIONS = "extensions.txt"
"""Comes last: what else is in it is shown better by others."""
PATIENCE_S = 60.0

ROBOTS = {"krc4": "kr_6_r900_sixx"}
"""What speaks in the transcripts of a folder that name no robot, where it is not the default one."""


class Turn(NamedTuple):
    """A line and its reply, said once or several times in a row, as by who polls."""

    command: str
    line: str
    reply: str
    times: int = 1


class _RobotTime:
    """The time of a stepped simulator: it passes when the transcript waits."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator

    def now_s(self) -> float:
        return self._simulator.state().time_s

    def wait(self, seconds: float) -> None:
        self._simulator.advance(seconds)


def held(*folders: str) -> list[list[Turn]]:
    """The dialogues of a folder of protocol/transcripts, one for each transcript.

    Raises RuntimeError where one is answered otherwise than it says: then the page would be wrong, too.
    """
    transcripts = sorted(shipped(*folders), key=lambda each: each.name == EXTENSIONS)
    return [_held(transcript, ROBOTS.get("".join(folders))) for transcript in transcripts]


def _held(transcript: Transcript, robot: str | None) -> list[Turn]:
    with Simulator(transcript.robot or robot, dialects=transcript.dialects, clock="stepped") as simulator:
        simulator.dialogue.remember()
        ports = [simulator.ports[dialect] for dialect in transcript.dialects]
        deviations = [*replay(transcript, simulator.host, ports, robot_time=_RobotTime(simulator))]
        if deviations:
            raise RuntimeError(f"{transcript.name}:{deviations[0].line}: {deviations[0]}")
        return turns(simulator.dialogue.exchanges())


def turns(exchanges: Sequence[Exchange]) -> list[Turn]:
    """Exchanges, with those that are said again at once counted."""
    found: list[Turn] = []
    for _, command, line, reply in exchanges:
        last = found[-1] if found else None
        if last is not None and (last.line, last.reply) == (line, reply):
            found[-1] = last._replace(times=last.times + 1)
        else:
            found.append(Turn(command, line, reply))
    return found


def example(dialogues: Sequence[Sequence[Turn]], command: str) -> list[Turn]:
    """Where a command is first carried out, with what is said before and behind; else where it is refused."""
    for wanted in (False, True):
        for dialogue in dialogues:
            for place, turn in enumerate(dialogue):
                if turn.command == command and _is_refused(turn) is wanted:
                    return [*dialogue[max(place - 1, 0) : place + 3]]
    raise RuntimeError(f"{command}: nowhere said in protocol/transcripts")


def refusals(dialogues: Sequence[Sequence[Turn]], command: str) -> list[tuple[str, str]]:
    """Lines of a command that were refused, each with what `get error` told then."""
    return [
        (turn.line, after.reply)
        for dialogue in dialogues
        for turn, after in pairwise(dialogue)
        if turn.command == command and turn.reply == "error" and after.command == "get error"
    ]


def refused_messages(dialogues: Sequence[Sequence[Turn]], message: str) -> list[tuple[str, str]]:
    """Messages in KRC4 that were refused, each with the code of its reply and what that means."""
    found = []
    for turn in (each for dialogue in dialogues for each in dialogue if each.command == message):
        code = re.search(r"\bI1=-\d+ I2=(\d+)", turn.reply)
        if code is not None:
            found.append((turn.line, f"{code[1]} {load_error_codes()[int(code[1])].meaning}"))
    return found


def refused_lines(dialogues: Sequence[Sequence[Turn]], command: str) -> list[tuple[str, str]]:
    """Lines of the backdoor that were refused, each with code and reason."""
    return [
        (turn.line, turn.reply.removeprefix("error "))
        for dialogue in dialogues
        for turn in dialogue
        if turn.command == command and turn.reply.startswith("error ")
    ]


def _is_refused(turn: Turn) -> bool:
    words = turn.reply.split()
    return turn.reply in REFUSED or (words[:1] == ["Res"] and "I1=-" in turn.reply) or words[:1] == ["error"]


def text(said: Sequence[Turn]) -> str:
    """A dialogue as lines: `>` said, `<` answered."""
    lines = []
    for turn in said:
        lines.append(f"> {turn.line}")
        again = f"    ({turn.times} times)" if turn.times > 1 else ""
        lines.append(f"< {turn.reply}{again}")
    return "\n".join(lines)


def spoken(transcript: Transcript) -> list[Turn]:
    """A transcript whose lines and replies hold as they stand, such as that of the backdoor."""
    asked = [step.text for step in transcript.steps if isinstance(step, Said)]
    told = [step.text for step in transcript.steps if isinstance(step, Answered)]
    return [Turn(command_of(line), line, reply) for line, reply in zip(asked, told, strict=True)]


def asked_of_the_backdoor(lines: Iterable[str]) -> list[Turn]:
    """Lines that no transcript has, since their replies tell of time, with the replies to them."""
    with Simulator(clock="stepped", backdoor_port=0) as simulator:
        address = (simulator.backdoor_host, simulator.backdoor_port)
        with socket.create_connection(address, timeout=PATIENCE_S) as bench, bench.makefile("r") as replies:
            said = []
            for line in lines:
                bench.sendall(f"{line}\r\n".encode())
                said.append(Turn(line, line, replies.readline().strip()))
            return said
