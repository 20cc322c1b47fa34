"""What waits in the node's process for an answer of iiwa-sim: calls of services, and goals that may be
rejected."""

import threading
from typing import Any

from .out import Out

ANSWER_S = 60.0
"""What has no answer by then fails: iiwa-sim is there as long as standard input is, but may be slow."""


class Calls:
    """Questions of one kind, by number."""

    def __init__(self, out: Out, kind: str) -> None:
        """`kind` is the name of the number in the lines that go out."""
        self._out = out
        self._kind = kind
        self._lock = threading.Lock()
        self._next = 0
        self._closed = False
        self._waiting: dict[int, Any] = {}

    def ask(self, **what: Any) -> tuple[int, Any]:
        """Number and answer; the answer is None where none came in time."""
        there = threading.Event()
        with self._lock:
            self._next += 1
            number = self._next
            self._waiting[number] = [there, None]
        self._out.tell(**{self._kind: number}, **what)
        if self._closed:
            there.set()
        there.wait(ANSWER_S)
        with self._lock:
            return number, self._waiting.pop(number)[1]

    def close(self) -> None:
        """Let all that wait fail: nobody answers any more."""
        with self._lock:
            self._closed = True
            for there, _ in self._waiting.values():
                there.set()

    def answered(self, number: int, answer: Any) -> None:
        """An answer has come."""
        with self._lock:
            waiting = self._waiting.get(number)
            if waiting is not None:
                waiting[1] = answer
                waiting[0].set()
