r"""Transcripts read: which client says what when, and what it is to be answered.

    # a comment; blank lines count for nothing
    only lbr_iiwa_7_r800 at home    what follows holds for that robot, in that pose
    > get status                    said
    < stopped                       and answered so, word for word
    <~0.5 450 0 520 0 -1.57 0       numbers, as many, each within 0.5; `<~` alone: within 1e-6; `<~inf`: any
    <? 3021 out of reach            whatever it is: what stands here is not compared
    wait stopped                    `get status` is asked until it says stopped
    wait 0.5                        seconds
    driver> hello                   a client with a name, if there are several
    driver connects                 before its first line it does so anyway
    driver leaves                   its connection is closed
    [12.5 0.514] driver> hello      with times, simulated and real, in s since the beginning

Each line that is said has its reply further down, in the order of the lines of that client. In what is said
and in a reply, `{get tool frame}` stands for the last reply to that command, `{get tool frame 3}` for its
third number, and `{get tool frame + 0 0 9 0 0 0}` for its numbers with these added. Bytes that do not print
are written as `\x09`, a backslash as `\\`, a brace that is one as `\x7b`.
"""

import math
import re
from collections import Counter
from enum import Enum
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.transcript.fault import TranscriptFault

MAX_BYTES = 100_000_000
"""Of a file; some days of a driver's polls."""

WITHIN = 1e-6
"""How far numbers may be off where a transcript does not say it."""

_LINE = re.compile(
    r"(?:\[\s*(?P<simulated>[0-9.]+)\s+(?P<real>[0-9.]+)\s*\]\s*)?"
    r"(?:(?P<only>only)\s+(?P<robot>\S+) at home"
    r"|(?P<client>[A-Za-z]\w*(?=\s*[<>]|\s+[a-z]))?\s*"
    r"(?:(?P<mark>>|<~[^\s]*|<\?|<)(?: (?P<text>.*))?"
    r"|(?P<event>connects|leaves)"
    r"|wait\s+(?P<wait>\S+)))\s*"
)


class Compare(Enum):
    """How a reply is compared."""

    EXACT = "<"
    NUMBERS = "<~"
    ANY = "<?"


class Step(NamedTuple):
    """What every line has."""

    line: int
    """Its number in the file, from 1."""
    client: str
    """Its name; empty where there is but one."""
    at_s: float | None
    """When, in simulated time since the beginning, if the transcript says it."""


class Said(NamedTuple):
    """A client says something."""

    step: Step
    text: str


class Answered(NamedTuple):
    """And is answered."""

    step: Step
    text: str
    compare: Compare
    within: float


class Connects(NamedTuple):
    """A client comes."""

    step: Step


class Leaves(NamedTuple):
    """A client goes."""

    step: Step


class Wait(NamedTuple):
    """Time passes."""

    step: Step
    seconds: float | None
    """None: until the robot has stopped."""


Steps = Said | Answered | Connects | Leaves | Wait


class Transcript(NamedTuple):
    """A dialogue."""

    name: str
    """Of its file."""
    steps: tuple[Steps, ...]
    robot: str
    """Which robot, at home, it holds for; empty for any."""

    @property
    def commands(self) -> set[str]:
        """The commands that are said, without their parameters."""
        return {command_of(step.text) for step in self.steps if isinstance(step, Said)}


def read_file(path: Path) -> Transcript:
    """The transcript of that name. Raises TranscriptFault."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise TranscriptFault(f"{path}: cannot be read: {fault.strerror}") from None
    if len(data) > MAX_BYTES:
        raise TranscriptFault(f"{path}: expected a transcript, of at most {MAX_BYTES} bytes")
    return read(str(path), data.decode("utf-8", "backslashreplace"))


def read(name: str, text: str) -> Transcript:
    """A transcript from its text; `name` names it in faults. Raises TranscriptFault."""
    robot = ""
    steps: list[Steps] = []
    unanswered: Counter[str] = Counter()
    last_said: dict[str, int] = {}
    for number, line in enumerate(text.split("\n"), 1):
        line = line.removesuffix("\r")
        if not line.strip() or line.startswith("#"):
            continue
        found = _LINE.fullmatch(line)
        if found is None:
            raise _fault(name, number, line, "expected `> words`, `< words`, a wait, connects or leaves")
        if found["only"]:
            robot = found["robot"]
            continue
        step = _step(name, number, line, found)
        steps.append(step)
        client = step.step.client
        if isinstance(step, Said):
            unanswered[client] += 1
            last_said[client] = number
        elif isinstance(step, Answered):
            unanswered[client] -= 1
            if unanswered[client] < 0:
                raise _fault(name, number, line, "a reply to nothing")
    for client, number in last_said.items():
        if unanswered[client]:
            raise _fault(name, number, "", "expected a reply to each line, `<?` for any")
    return Transcript(name, tuple(steps), robot)


def shipped() -> list[Transcript]:
    """Those of protocol/transcripts, by name."""
    folder = files("iiwa_sim.protocol").joinpath("transcripts")
    found = sorted(folder.iterdir(), key=lambda each: each.name)
    return [read(each.name, each.read_text("utf-8")) for each in found if each.name.endswith(".txt")]


def command_of(text: str) -> str:
    """The command of a line, in lower case and with single blanks."""
    return " ".join(text.partition(":")[0].lower().split())


def wire_bytes(text: str) -> bytes:
    """What is sent for a line, without its end. Raises ValueError for an escape that is none."""
    return re.sub(rb"\\(x[0-9a-f]{2}|.|$)", _unescaped, text.encode())


def _unescaped(found: re.Match[bytes]) -> bytes:
    escape = found[1]
    if escape.startswith(b"x") and len(escape) == 3:
        return bytes([int(escape[1:], 16)])
    plain = {b"\\": b"\\", b"'": b"'", b"t": b"\t", b"n": b"\n", b"r": b"\r"}
    if escape not in plain:
        raise ValueError(f"no escape: {found[0]!r}")
    return plain[escape]


def _step(name: str, number: int, line: str, found: re.Match[str]) -> Steps:
    try:
        at_s = None if found["simulated"] is None else _number(found["simulated"])
        step = Step(number, found["client"] or "", at_s)
        if found["event"]:
            return Connects(step) if found["event"] == "connects" else Leaves(step)
        if found["wait"]:
            return Wait(step, None if found["wait"] == "stopped" else _number(found["wait"]))
        text, mark = found["text"] or "", found["mark"]
        if mark == ">":
            wire_bytes(text)
            return Said(step, text)
        if not mark.startswith("<~"):
            return Answered(step, text, Compare(mark), 0.0)
        within = WITHIN if mark == "<~" else _number(mark[2:])
        return Answered(step, text, Compare.NUMBERS, within)
    except ValueError as fault:
        raise _fault(name, number, line, str(fault)) from None


def _number(word: str) -> float:
    value = float(word)
    if math.isnan(value) or value < 0.0:
        raise ValueError(f"expected a number, at least 0, got {word!r}")
    return value


def _fault(name: str, number: int, line: str, reason: str) -> TranscriptFault:
    quoted = f"'{line}': " if line else ""
    return TranscriptFault(f"{name}:{number}: {quoted}{reason}")
