r"""Transcripts read: which client says what when, and what it is to be answered.

    # a comment; blank lines count for nothing
    only lbr_iiwa_7_r800 at home    what follows holds for that robot, in that pose
    protocol krc4                    what clients speak; without it: iiwa
    protocol iiwa,krc4               each on a port of its own, the first where a client does not say it
    > get status                    said
    < stopped                       and answered so, word for word
    <~0.5 450 0 520 0 -1.57 0       numbers, as many, each within 0.5; `<~` alone: within 1e-6; `<~inf`: any
    <~0.5 the force is 81 N         these words, each number among them within 0.5
    <? 3021 out of reach            whatever it is: what stands here is not compared
    wait stopped                    `get status` is asked until it says stopped
    wait 0.5                        seconds
    driver> hello                   a client with a name, if there are several
    driver connects                 before its first line it does so anyway
    driver connects in krc4         and speaks that, from then on
    driver leaves                   its connection is closed
    [12.5 0.514] driver> hello      with times, simulated and real, in s since the beginning

Each line that is said has its reply further down, in the order of the lines of that client.
Texts are those of `iiwa_sim.transcript.texts`.
"""

import math
import re
from codecs import BOM_UTF8
from collections import Counter
from enum import Enum
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.protocols.ports import DEFAULT_PORTS, DEFAULT_PROTOCOL, KRC4
from iiwa_sim.transcript.texts import TranscriptFault, check, check_reply, topic

MAX_BYTES = 100_000_000
"""Largest file in bytes: some days of a driver's polls."""

WITHIN = 1e-6
"""Default tolerance of numbers."""

_LINE = re.compile(
    r"(?:\[\s*(?P<simulated>[0-9.]+)\s+(?P<real>[0-9.]+)\s*\]\s*)?"
    r"(?:(?P<only>only)\s+(?P<robot>\S+) at home"
    r"|protocol\s+(?P<protocols>\S+)"
    r"|(?P<client>[A-Za-z]\w*(?=\s*[<>]|\s+[a-z]))?\s*"
    r"(?:(?P<mark>>|<~[^\s]*|<\?|<)(?: (?P<text>.*))?"
    r"|(?P<event>connects|leaves)(?:(?<=connects)\s+in\s+(?P<protocol>\S+))?"
    r"|wait\s+(?P<wait>\S+)))\s*"
)


class Compare(Enum):
    """How a reply is compared."""

    EXACT = "<"
    NUMBERS = "<~"
    ANY = "<?"


class Step(NamedTuple):
    """The common fields of all lines."""

    line: int
    """The number of the line in the file, from 1."""
    client: str
    """Name of the client; empty if there is only one."""
    at_s: float | None
    """Simulated time (s) since the beginning, if the transcript has times."""
    protocol: str = DEFAULT_PROTOCOL
    """The client's protocol, one of `iiwa_sim.protocols.ports`."""


class Said(NamedTuple):
    """A client sends a line."""

    step: Step
    text: str


class Answered(NamedTuple):
    """A client gets a reply."""

    step: Step
    text: str
    compare: Compare
    within: float | None
    """Tolerance of numbers; None where they are not compared as such."""


class Connects(NamedTuple):
    """A client connects."""

    step: Step


class Leaves(NamedTuple):
    """A client disconnects."""

    step: Step


class Wait(NamedTuple):
    """Time passes before the next line."""

    step: Step
    seconds: float | None
    """Time to wait. With None the wait ends when the robot has stopped."""


Steps = Said | Answered | Connects | Leaves | Wait


class Transcript(NamedTuple):
    """A dialogue."""

    name: str
    """Name of its file."""
    steps: tuple[Steps, ...]
    robot: str
    """The robot, at home, that it holds for; empty for any."""
    protocols: tuple[str, ...] = (DEFAULT_PROTOCOL,)
    """The protocols of the dialogue, each on a port of its own."""

    @property
    def commands(self) -> set[str]:
        """The commands that are sent, without parameters; of KRC4 messages the tags, such as GOP."""
        return {topic(step.step.protocol, step.text) for step in self.steps if isinstance(step, Said)}


def read_file(path: Path) -> Transcript:
    """The transcript of a file. Raises TranscriptFault."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise TranscriptFault(f"{path}: cannot be read: {fault.strerror}") from None
    if len(data) > MAX_BYTES:
        raise TranscriptFault(f"{path}: expected a transcript, of at most {MAX_BYTES} bytes")
    return read(str(path), data.removeprefix(BOM_UTF8).decode("utf-8", "backslashreplace"))


def read(name: str, text: str) -> Transcript:
    """The transcript of a text; `name` names it in errors. Raises TranscriptFault."""
    robot = ""
    protocols: tuple[str, ...] = (DEFAULT_PROTOCOL,)
    spoken: dict[str, str] = {}
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
        try:
            if found["protocols"]:
                if steps:
                    raise ValueError("expected above all that is said")
                protocols = _protocols(found["protocols"])
                continue
            client = found["client"] or ""
            protocol = found["protocol"] or spoken.get(client, protocols[0])
            if protocol not in protocols:
                raise ValueError(f"expected one of the protocols of this transcript, {', '.join(protocols)}")
            spoken[client] = protocol
            step = _step(number, found, protocol)
        except ValueError as fault:
            raise _fault(name, number, line, str(fault)) from None
        steps.append(step)
        if isinstance(step, Said):
            unanswered[client] += 1
            last_said[client] = number
        elif isinstance(step, Answered):
            unanswered[client] -= 1
            if unanswered[client] < 0:
                raise _fault(name, number, line, "a reply to nothing")
        elif unanswered[client] and (
            isinstance(step, Leaves) or (isinstance(step, Wait) and step.seconds is None)
        ):
            raise _fault(name, number, line, "expected the replies to the lines above it first")
    for client, number in last_said.items():
        if unanswered[client]:
            raise _fault(name, number, "", "expected a reply to each line, `<?` for any")
    return Transcript(name, tuple(steps), robot, protocols)


def shipped(*folders: str) -> list[Transcript]:
    """The transcripts of protocol/transcripts, or of a folder in it, by name."""
    folder = files("iiwa_sim.protocol").joinpath("transcripts", *folders)
    found = sorted(folder.iterdir(), key=lambda each: each.name)
    return [read(each.name, each.read_text("utf-8")) for each in found if each.name.endswith(".txt")]


def _step(number: int, found: re.Match[str], protocol: str) -> Steps:
    at_s = None if found["simulated"] is None else _number(found["simulated"])
    step = Step(number, found["client"] or "", at_s, protocol)
    if found["event"]:
        return Connects(step) if found["event"] == "connects" else Leaves(step)
    if found["wait"]:
        return Wait(step, None if found["wait"] == "stopped" else _number(found["wait"]))
    text, mark = found["text"] or "", found["mark"]
    if mark == ">":
        check(protocol, text)
        return Said(step, text)
    compare = Compare.NUMBERS if mark.startswith("<~") else Compare(mark)
    if protocol == KRC4 and compare is not Compare.ANY:
        check_reply(text, verbatim=compare is Compare.EXACT)
    within = None
    if compare is Compare.NUMBERS:
        within = WITHIN if mark == "<~" else _number(mark[2:])
    return Answered(step, text, compare, within)


def _protocols(text: str) -> tuple[str, ...]:
    names = text.split(",")
    if len(set(names)) < len(names) or not set(names) <= set(DEFAULT_PORTS):
        raise ValueError(f"expected {' or '.join(DEFAULT_PORTS)}, each at most once, a comma between")
    return tuple(names)


def _number(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if math.isnan(value) or value < 0.0:
        raise ValueError(f"expected a number, at least 0, got {word!r}")
    return value


def _fault(name: str, number: int, line: str, reason: str) -> TranscriptFault:
    quoted = f"'{line}': " if line else ""
    return TranscriptFault(f"{name}:{number}: {quoted}{reason}")
