"""The end of what was said in all dialects, for whoever asks for it over HTTP."""

from collections import deque

from iiwa_sim.dialect.wire.dialogue import Said

MOST = 1000
"""Lines that are kept, the newest ones."""


class Heard:
    """A listener of a `Dialogue`."""

    def __init__(self, tick_s: float) -> None:
        """Ticks last `tick_s`."""
        self._tick_s = tick_s
        self._said: deque[Said] = deque(maxlen=MOST)
        self._count = 0

    def __call__(self, said: Said) -> None:
        self._count += 1
        self._said.append(said)

    def as_json(self) -> dict[str, object]:
        """The lines, oldest first, with simulated seconds, and how many came before them and are forgotten.

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
