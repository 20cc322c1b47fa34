"""Transcripts read: the commands of each client, with times, and the expected replies.

docs/recordings.md describes the lines. Each command has its reply further down, in the order of the
lines of that client. Texts are those of `iiwa_sim.transcript.texts`.
"""

import re
from codecs import BOM_UTF8
from collections import defaultdict
from enum import Enum
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.protocols.ports import DEFAULT_PORTS, DEFAULT_PROTOCOL
from iiwa_sim.transcript.texts import TranscriptFault, topic

WITHIN = 1e-6
"""Default tolerance of numbers."""

_LINE = re.compile(
    r"(?:\[\s*(?P<simulated>[0-9.]+)\s+(?P<real>[0-9.]+)\s*\]\s*)?"
    r"(?:only\s+(?P<robot>\S+) at home"
    r"|protocol\s+(?P<protocols>\S+)"
    r"|(?P<client>[A-Za-z]\w*(?=\s*[<>]|\s+[a-z]))?\s*"
    r"(?:(?P<mark>>|<~|<\?|<)(?P<within>(?<=~)(?:[0-9.]+|inf))?(?: (?P<text>.*))?"
    r"|(?P<event>connects|leaves)(?:(?<=connects)\s+in\s+(?P<protocol>\S+))?"
    r"|wait\s+(?P<wait>stopped|[0-9.]+)))\s*"
)


class Kind(Enum):
    """The kind of a line."""

    COMMAND = ">"
    EXACT = "<"
    """A reply, word for word."""
    NUMBERS = "<~"
    """A reply whose numbers are compared within a tolerance."""
    ANY = "<?"
    CONNECTS = "connects"
    LEAVES = "leaves"
    WAIT = "wait"

    @property
    def is_reply(self) -> bool:
        return self in (Kind.EXACT, Kind.NUMBERS, Kind.ANY)


class Step(NamedTuple):
    """A line of a transcript."""

    kind: Kind
    line: int
    """The number of the line in the file, from 1."""
    client: str
    """Name of the client; empty if there is only one."""
    at_s: float | None
    """Simulated time (s) since the beginning, if the transcript has times."""
    protocol: str
    """The client's protocol, one of `iiwa_sim.protocols.ports`."""
    text: str
    """The words of a line or a reply."""
    number: float | None
    """Tolerance of NUMBERS, else None; seconds of a WAIT, None until the robot has stopped."""


class Transcript(NamedTuple):
    """A dialogue."""

    name: str
    """Name of its file."""
    steps: tuple[Step, ...]
    robot: str
    """The robot, at home, that it holds for; empty for any."""
    protocols: tuple[str, ...] = (DEFAULT_PROTOCOL,)
    """The protocols of the dialogue, each on a port of its own."""

    @property
    def commands(self) -> set[str]:
        """The commands that are sent, without parameters; of KRC4 messages the tags, such as GOP."""
        return {topic(step.protocol, step.text) for step in self.steps if step.kind is Kind.COMMAND}


def read_file(path: Path) -> Transcript:
    """Return the transcript of a file. Raises TranscriptFault."""
    try:
        data = path.read_bytes()
    except OSError as fault:
        raise TranscriptFault(f"{path}: cannot be read: {fault.strerror}") from None
    return read(str(path), data.removeprefix(BOM_UTF8).decode("utf-8", "backslashreplace"))


def read(name: str, text: str) -> Transcript:
    """Return the transcript of a text; `name` names it in errors. Raises TranscriptFault."""
    robot = ""
    protocols: tuple[str, ...] = (DEFAULT_PROTOCOL,)
    spoken: dict[str, str] = {}
    steps: list[Step] = []
    unanswered: dict[str, list[int]] = defaultdict(list)  # numbers of commands, by client
    for number, line in enumerate(text.split("\n"), 1):
        line = line.removesuffix("\r")
        if not line.strip() or line.startswith("#"):
            continue
        found = _LINE.fullmatch(line)
        try:
            if found is None:
                raise ValueError("expected `> words`, `< words`, a wait, connects or leaves")
            if found["robot"]:
                robot = found["robot"]
                continue
            if found["protocols"]:
                protocols = tuple(found["protocols"].split(","))
                if steps or len(DEFAULT_PORTS.keys() & set(protocols)) < len(protocols):
                    choice = " or ".join(DEFAULT_PORTS)
                    raise ValueError(f"expected {choice}, each at most once, with a comma, above all lines")
                continue
            client = found["client"] or ""
            protocol = found["protocol"] or spoken.get(client, protocols[0])
            if protocol not in protocols:
                raise ValueError(f"expected one of the protocols of this transcript, {', '.join(protocols)}")
            spoken[client] = protocol
            step = _step(number, found, protocol)
            pending = unanswered[client]
            if step.kind is Kind.COMMAND:
                pending.append(number)
            elif step.kind.is_reply:
                if not pending:
                    raise ValueError("a reply to nothing")
                del pending[0]
            elif pending and (step.kind is Kind.LEAVES or (step.kind is Kind.WAIT and step.number is None)):
                raise ValueError("expected the replies to the lines above it first")
        except ValueError as fault:
            raise TranscriptFault(f"{name}:{number}: '{line}': {fault}") from None
        steps.append(step)
    for left in filter(None, unanswered.values()):
        raise TranscriptFault(f"{name}:{left[-1]}: expected a reply to each line, `<?` for any")
    return Transcript(name, tuple(steps), robot, protocols)


def shipped(*folders: str) -> list[Transcript]:
    """Return the transcripts of protocol/transcripts, or of a folder in it, by name."""
    folder = files("iiwa_sim.protocol").joinpath("transcripts", *folders)
    found = sorted(folder.iterdir(), key=lambda each: each.name)
    return [read(each.name, each.read_text("utf-8")) for each in found if each.name.endswith(".txt")]


def _step(number: int, found: re.Match[str], protocol: str) -> Step:
    at_s = None if found["simulated"] is None else float(found["simulated"])
    kind = Kind(found["mark"] or found["event"] or "wait")
    value = found["within"] or found["wait"] or (WITHIN if kind is Kind.NUMBERS else None)
    value = None if value in (None, "stopped") else float(value)
    return Step(kind, number, found["client"] or "", at_s, protocol, found["text"] or "", value)
