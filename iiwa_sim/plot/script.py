"""A file of commands: the lines for the robot and the waits between them.

One command per line, as on the wire. What follows a `#` is a comment; blank lines count for nothing. Commands
follow each other at once, within one tick, except where the file says

    wait SECONDS        the robot moves on for so long, in simulated time
    wait stopped        until `get status` would say stopped
    protocol krc4        above all commands: these are KRC4 messages, in their short form or word for word
"""

from codecs import BOM_UTF8
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.protocols.decimals import parse_decimal
from iiwa_sim.protocols.ports import DEFAULT_PORTS, DEFAULT_PROTOCOL
from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_S = 600.0
"""Longest simulated time (s) of a picture."""
MAX_BYTES = 10_000_000
"""Largest file in bytes; a larger one is no file of commands."""
LONGEST_MESSAGE = 400
"""Most characters of a message, which may quote paths and commands."""


class PlotFault(Unusable):
    """A picture cannot be made. The message is one line that names the file and what is wrong."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


class Command(NamedTuple):
    """A line for the robot."""

    line: int
    """The number of the line in the file, from 1."""
    text: str


class Wait(NamedTuple):
    """A wait of simulated time before the next command."""

    line: int
    text: str
    seconds: float | None
    """None: until the robot has stopped."""


class Script(NamedTuple):
    """A parsed file of commands."""

    path: str
    steps: tuple[Command | Wait, ...]
    protocol: str = DEFAULT_PROTOCOL

    def fault(self, step: Command | Wait, reason: str) -> PlotFault:
        """Build the error for a step, with the file, the line, its text and the reason."""
        return PlotFault(f"{self.path}: line {step.line}: '{step.text}': {reason}")


def read_script(path: str) -> Script:
    """Read the script in a file. Raises `PlotFault` if it is unreadable or has a malformed wait."""
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise PlotFault(f"{path}: cannot be read: {fault.strerror}") from None
    if len(data) > MAX_BYTES:
        raise PlotFault(f"{path}: expected a file of commands, of at most {MAX_BYTES} bytes")
    return parse_script(path, data.removeprefix(BOM_UTF8))


def parse_script(path: str, data: bytes) -> Script:
    """Parse the bytes of a file; `path` names it in messages."""
    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise PlotFault(f"{path}: expected text in UTF-8 ({fault})") from None
    steps: list[Command | Wait] = []
    protocol = DEFAULT_PROTOCOL
    for number, line in enumerate(data.removeprefix(b"\xef\xbb\xbf").splitlines(), start=1):
        text = line.partition(b"#")[0].strip(b" \t").decode()
        if text.split()[:1] == ["protocol"]:
            protocol = text.removeprefix("protocol").strip()
            if protocol not in DEFAULT_PORTS or steps:
                known = " or ".join(DEFAULT_PORTS)
                raise PlotFault(f"{path}: line {number}: '{text}': expected {known}, above all commands")
        elif text:
            steps.append(_step(path, number, text))
    if not steps:
        raise PlotFault(f"{path}: expected commands, one per line, and found none")
    return Script(path, tuple(steps), protocol)


def _step(path: str, number: int, text: str) -> Command | Wait:
    words = text.lower().split()
    if words[:1] != ["wait"]:
        return Command(number, text)
    if words[1:] == ["stopped"]:
        return Wait(number, text, None)
    try:
        (word,) = words[1:]
        seconds = parse_decimal(word.encode())
    except ValueError:  # not one word, or no number
        seconds = -1.0
    if not 0.0 <= seconds <= LONGEST_S:
        expected = f"expected 'wait SECONDS', 0 to {LONGEST_S:g}, or 'wait stopped'"
        raise PlotFault(f"{path}: line {number}: '{text}': {expected}")
    return Wait(number, text, seconds)
