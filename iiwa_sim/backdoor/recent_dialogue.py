"""The most recent lines of all protocols, and what the backdoor was used for, for whoever asks for them."""

import time
from collections import deque

import msgspec

from iiwa_sim.protocols.dialogue import Dialogue, DialogueLine, Direction

MOST = 1000
"""Number of lines kept."""
MOST_AT_ONCE = 200
"""Number of lines that one answer to `since` has, the newest ones."""


class RecentLine(msgspec.Struct, frozen=True, omit_defaults=True):
    """A line of a dialogue, or an event."""

    time_s: float
    """Simulated time (s)."""
    session: str
    """HOST:PORT of the client, or the name of what else speaks."""
    mark: str
    """`>` from a client, `<` to it, `#` an event, `~` what a wire fault made of the reply before."""
    text: str
    reason: str = ""
    """Why a line was refused, with the reply to it."""


class RecentLines(msgspec.Struct, frozen=True):
    """Some of the lines, oldest first."""

    next: int
    """The number of the line to come next, for the next question. Lines are counted from 0."""
    lines: list[RecentLine]


class RecentDialogue:
    """Keeps the newest lines of a `Dialogue`, from the call of `listen` on."""

    def __init__(self, dialogue: Dialogue, tick_s: float) -> None:
        """`tick_s` is the duration of a tick (s)."""
        self._dialogue = dialogue
        self._tick_s = tick_s
        self._said: deque[DialogueLine] = deque(maxlen=MOST)
        self._count = 0

    def __call__(self, said: DialogueLine) -> None:
        self._count += 1
        self._said.append(said)

    def acted(self, tick: int, session: str, text: str, reason: str = "") -> None:
        """A test bench has done something by the backdoor, or was refused that for a `reason`."""
        if self in self._dialogue.listeners:
            self(DialogueLine(session, Direction.EVENT, text, tick, time.monotonic_ns(), reason))

    def listen(self) -> None:
        """Keep the lines that come from now on."""
        if self not in self._dialogue.listeners:
            self._dialogue.listeners.append(self)

    def since(self, number: int) -> RecentLines:
        """The newest of the lines from this number on, as far as they are kept."""
        wanted = min(self._count - number, len(self._said), MOST_AT_ONCE)
        newest = [self._said[place] for place in range(-wanted, 0)] if wanted > 0 else []
        return RecentLines(self._count, [self._line(said) for said in newest])

    def as_json(self) -> dict[str, object]:
        """All lines kept, as `RecentLine`, and the number of earlier lines that are forgotten."""
        lines = [self._line(said) for said in self._said]
        return {"forgotten": self._count - len(lines), "lines": msgspec.to_builtins(lines)}

    def _line(self, said: DialogueLine) -> RecentLine:
        return RecentLine(
            said.tick * self._tick_s, said.session, said.direction.value, said.text, said.reason
        )
