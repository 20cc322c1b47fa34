"""Sessions to serve that say what became of them."""

from __future__ import annotations

from collections import deque


class EchoSession:
    """Answers every line with itself, `lines_at_once` at a time; `bye` closes, `fault` raises."""

    def __init__(self, name: str, lines_at_once: int = 100, blow_up: int = 1) -> None:
        """A line that begins with # is repeated `blow_up` times in its reply."""
        self.name = name
        self.answered = 0
        self.times_lost = 0
        self.ended = False
        self.closing = False
        self.pending = None
        self.awaits = False
        self._lines_at_once = lines_at_once
        self._blow_up = blow_up
        self.waiting: deque[bytes] = deque()
        self._rest = b""

    def receive(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        self.waiting.extend(lines)

    def end(self) -> None:
        self.ended = True
        if self._rest:
            self.waiting.append(self._rest)

    def answer(self, most: int = 1_000_000) -> bytes:
        replies = []
        for _ in range(min(most, self._lines_at_once, len(self.waiting))):
            line = self.waiting.popleft().rstrip(b"\r")
            if line == b"fault":
                raise ZeroDivisionError("a fault of ours")
            replies.append(line * (self._blow_up if line.startswith(b"#") else 1) + b"\r\n")
            self.answered += 1
            if line == b"bye":
                self.closing = True
                self.waiting.clear()
                break
        return b"".join(replies)

    def lost(self) -> None:
        self.times_lost += 1
