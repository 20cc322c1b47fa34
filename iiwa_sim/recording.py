"""The dialogue and the state of a robot as text, for the report of a failed test."""

from collections import deque
from dataclasses import dataclass, field

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.protocols.decimals import format_decimals
from iiwa_sim.protocols.dialogue import DialogueLine, Direction

LONGEST = 300
"""Exchanges and events kept, the newest ones; a repeated exchange counts once."""


class Recording:
    """A listener of a `Dialogue` that keeps the end of it."""

    def __init__(self, tick_s: float, start_ns: int) -> None:
        """`tick_s` is the duration of a tick (s); real time counts from `start_ns` of `time.monotonic_ns`."""
        self._tick_s = tick_s
        self._start_ns = start_ns
        self._entries: deque[_Entry] = deque(maxlen=LONGEST)
        self._left_out = 0

    def __call__(self, said: DialogueLine) -> None:
        last = self._entries[-1] if self._entries else None
        if last is not None and last.takes(said):
            return
        self._merge()
        if len(self._entries) == LONGEST:
            self._left_out += 1
        self._entries.append(_Entry(said, said))

    def text(self) -> str:
        """The kept dialogue, with simulated and real seconds."""
        if not self._entries:
            return "nothing was said"
        self._merge()
        lines = ["simulated      real"]
        if self._left_out:
            lines.append(f"({self._left_out} before these are left out)")
        for entry in self._entries:
            said = entry.first
            lines.append(f"{self._when(said)}  {said.session} {said.direction.value} {said.text}")
            margin = " " * (21 + len(said.session))
            lines += [f"{margin} {mark.value} {text}" for mark, text in entry.answers]
            if entry.times > 1:
                lines[-1] += f"  ({entry.times} times, last at{self._when(entry.last)})"
        return "\n".join(lines)

    def _merge(self) -> None:
        """Merge the last exchange with the one before if they are equal, as those of a polling driver are."""
        if len(self._entries) < 2:
            return
        before, last = self._entries[-2], self._entries[-1]
        if last.answers and before.what == last.what:
            before.times += 1
            before.last = last.first
            self._entries.pop()

    def _when(self, said: DialogueLine) -> str:
        real_s = (said.instant_ns - self._start_ns) * 1e-9
        return f"{said.tick * self._tick_s:9.3f} {real_s:9.3f}"


@dataclass
class _Entry:
    """An event, or a line with its reply and the faults of that; possibly repeated."""

    first: DialogueLine
    last: DialogueLine
    answers: list[tuple[Direction, str]] = field(default_factory=list)
    times: int = 1

    def takes(self, said: DialogueLine) -> bool:
        """Add a line to this entry if it belongs to it; returns whether it does."""
        follows = {Direction.TO_CLIENT: 0, Direction.ON_WIRE: 1}.get(said.direction)
        if (self.first.direction, self.first.session, len(self.answers)) != (
            Direction.FROM_CLIENT,
            said.session,
            follows,
        ):
            return False
        self.answers.append((said.direction, said.text))
        return True

    @property
    def what(self) -> tuple[str, Direction, str, list[tuple[Direction, str]]]:
        return (self.first.session, self.first.direction, self.first.text, self.answers)


def told(state: Snapshot) -> str:
    """A state as text, one field per line."""
    return "\n".join(f"{name}: {_value(getattr(state, name))}" for name in state.__struct_fields__)


def _value(value: object) -> str:
    if isinstance(value, tuple) and value and all(isinstance(each, float) for each in value):
        return format_decimals(value).decode()
    if isinstance(value, tuple) and all(isinstance(each, bool) for each in value):
        return " ".join(str(int(each)) for each in value)
    return str(value)
