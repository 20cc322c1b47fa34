"""The most recent lines of all dialects, for requests over HTTP."""

from collections import deque

from iiwa_sim.dialect.wire.dialogue import DialogueLine

MOST = 1000
"""Number of lines kept."""


class RecentDialogue:
    """A listener of a `Dialogue` that keeps the newest lines."""

    def __init__(self, tick_s: float) -> None:
        """`tick_s` is the duration of a tick (s)."""
        self._tick_s = tick_s
        self._said: deque[DialogueLine] = deque(maxlen=MOST)
        self._count = 0

    def __call__(self, said: DialogueLine) -> None:
        self._count += 1
        self._said.append(said)

    def as_json(self) -> dict[str, object]:
        """The lines, oldest first, with simulated seconds, and the number of earlier lines that are
        forgotten.

        Marks are those of a transcript: `>` from a client, `<` to it, `#` an event, `~` what a fault made of
        the reply before.
        """
        lines = [
            {
                "time_s": said.tick * self._tick_s,
                "session": said.session,
                "mark": said.direction.value,
                "text": said.text,
            }
            for said in self._said
        ]
        return {"forgotten": self._count - len(lines), "lines": lines}
