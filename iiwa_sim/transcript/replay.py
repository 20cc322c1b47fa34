"""A transcript played against a server: what it says is said, what is answered is compared.

Lines with times are said at their simulated time since the beginning; others, and those that are late, as
soon as the line before is done with.
"""

import time
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

from iiwa_sim.transcript.compare import deviation, filled
from iiwa_sim.transcript.lines import (
    Answered,
    Connects,
    Leaves,
    Said,
    Steps,
    Transcript,
    Wait,
    command_of,
    wire_bytes,
)
from iiwa_sim.transcript.wire import TIMEOUT_S, NoReply, Wire

STOPPED_WITHIN_S = 60.0
"""How long `wait stopped` waits."""

POLL_PERIOD_S = 0.01


class Deviation(NamedTuple):
    """A line of the transcript that came out differently."""

    line: int
    said: str
    what: str

    def __str__(self) -> str:
        return f"'{self.said}': {self.what}" if self.said else self.what


def replay(transcript: Transcript, host: str, port: int, timeout_s: float = TIMEOUT_S) -> Iterator[Deviation]:
    """Plays it, telling each deviation when it is met. One that leaves a client out of step is the last.

    Raises TranscriptFault if the server cannot be reached.
    """
    player = _Player(host, port, timeout_s)
    try:
        for step in transcript.steps:
            player.keep_time(step.step.at_s)
            try:
                found = player.play(step)
            except _OutOfStep as end:
                yield Deviation(step.step.line, player.asked(step.step.client), str(end))
                return
            if found:
                yield Deviation(step.step.line, player.asked(step.step.client), found)
        for line, client, unread in player.unread():
            yield Deviation(line, client, f"more came than was asked for: '{unread}'")
    finally:
        player.close()


class _OutOfStep(Exception):
    """Nothing that follows could be compared."""


class _Client:
    """One of those who talk."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self.said: deque[str] = deque()
        """And not answered yet."""
        self.last = ""
        """What the last reply was to."""
        self.heard: dict[str, str] = {}
        """The last reply to each command."""
        self.line = 0


class _Player:
    """All clients of a transcript."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self._address = (host, port)
        self._timeout_s = timeout_s
        self._clients: dict[str, _Client] = {}
        self._began = time.monotonic()

    def keep_time(self, at_s: float | None) -> None:
        if at_s is not None:
            time.sleep(max(0.0, self._began + at_s - time.monotonic()))

    def asked(self, name: str) -> str:
        client = self._clients.get(name)
        return client.last if client else ""

    def play(self, step: Steps) -> str:
        """What was different, in words."""
        name = step.step.client
        if isinstance(step, Leaves):
            if name in self._clients:
                self._clients.pop(name).wire.close()
            return ""
        if name not in self._clients:
            self._clients[name] = _Client(Wire(*self._address, self._timeout_s))
        client = self._clients[name]
        client.line = step.step.line
        match step:
            case Connects():
                return ""
            case Said():
                self._say(client, step.text)
                return ""
            case Answered():
                return self._hear(client, step)
            case Wait():
                self._wait(client, step.seconds)
                return ""

    def unread(self) -> Iterator[tuple[int, str, str]]:
        """What clients were told without asking, with their last lines."""
        for client in self._clients.values():
            if client.wire.unread:
                yield client.line, client.last, client.wire.unread

    def close(self) -> None:
        for client in self._clients.values():
            client.wire.close()

    def _say(self, client: _Client, text: str) -> None:
        try:
            line = filled(text, client.heard)
            client.wire.send(wire_bytes(line) + b"\r\n")
        except (NoReply, ValueError) as fault:
            client.last = text
            raise _OutOfStep(str(fault)) from None
        client.said.append(line)

    def _hear(self, client: _Client, expected: Answered) -> str:
        client.last = client.said.popleft()
        reply = self._reply(client)
        found = deviation(expected, reply, client.heard)
        client.heard[command_of(client.last)] = reply
        return found

    def _wait(self, client: _Client, seconds: float | None) -> None:
        if seconds is not None:
            time.sleep(seconds)
            return
        deadline = time.monotonic() + STOPPED_WITHIN_S
        while True:
            self._say(client, "get status")
            client.last = client.said.popleft()
            reply = self._reply(client)
            if reply == "stopped":
                return
            if reply != "moving":
                raise _OutOfStep(f"expected 'moving' or 'stopped', got '{reply}'")
            if time.monotonic() > deadline:
                raise _OutOfStep(f"still moving after {STOPPED_WITHIN_S:g} s")
            time.sleep(POLL_PERIOD_S)

    def _reply(self, client: _Client) -> str:
        try:
            return client.wire.reply()
        except NoReply as fault:
            raise _OutOfStep(str(fault)) from None
