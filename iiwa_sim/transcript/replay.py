"""Plays a transcript against a server: sends its lines and compares the replies.

Lines with times are sent at their simulated time since the beginning; other lines, and late ones, as soon as
the line before is done.
"""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.lines import Answered, Connects, Leaves, Said, Steps, Transcript, Wait
from iiwa_sim.transcript.speech import SPEECH, Speech
from iiwa_sim.transcript.wire import TIMEOUT_S, MessageWire, NoReply, Wire

STOPPED_WITHIN_S = 60.0
"""Seconds for which `wait stopped` waits."""

POLL_PERIOD_S = 0.01


class Deviation(NamedTuple):
    """A line of the transcript whose outcome differs."""

    line: int
    said: str
    what: str

    def __str__(self) -> str:
        return f"'{self.said}': {self.what}" if self.said else self.what


class Time(Protocol):
    """Lets time pass for the robot that a transcript is played against."""

    def now_s(self) -> float: ...
    def wait(self, seconds: float) -> None: ...


class RealTime:
    """Real time, for a robot that moves by itself."""

    def now_s(self) -> float:
        return time.monotonic()

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)


def replay(
    transcript: Transcript,
    host: str,
    port: int | Sequence[int],
    timeout_s: float = TIMEOUT_S,
    robot_time: Time | None = None,
) -> Iterator[Deviation]:
    """Play a transcript; yields each deviation. One after which a client is out of step is the last.

    There is a port for each protocol of the transcript. Waits are in the robot's time, real time by default,
    except for the wait of `timeout_s` for each reply.

    Raises TranscriptFault if the server cannot be reached, if ports and protocols do not match, or if nothing
    is sent: an empty recording must not pass.
    """
    if not any(isinstance(step, Said) for step in transcript.steps):
        raise TranscriptFault(f"{transcript.name}: expected a line `> command` at least")
    ports = [port] if isinstance(port, int) else port
    if len(ports) != len(transcript.protocols):
        given = f"{len(ports)} port{'' if len(ports) == 1 else 's'}"
        wanted = f"{len(transcript.protocols)}, one each for {', '.join(transcript.protocols)}"
        raise TranscriptFault(f"{transcript.name}: {given}, expected {wanted}")
    player = _Player(transcript, host, ports, timeout_s, robot_time or RealTime())
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
    """Client and server are out of step: nothing that follows can be compared."""


class _Client:
    """A client of the transcript."""

    def __init__(self, wire: Wire | MessageWire, speech: Speech) -> None:
        self.wire = wire
        self.speech = speech
        self.said: deque[str] = deque()
        """Lines without a reply yet."""
        self.last = ""
        """The line of the last reply."""
        self.heard: dict[str, str] = {}
        """The last reply to each command, by topic."""
        self.line = 0


class _Player:
    """All clients of a transcript."""

    def __init__(
        self, transcript: Transcript, host: str, ports: Sequence[int], timeout_s: float, robot_time: Time
    ) -> None:
        self._transcript = transcript
        self._host = host
        self._ports = dict(zip(transcript.protocols, ports, strict=True))
        self._timeout_s = timeout_s
        self._time = robot_time
        self._clients: dict[str, _Client] = {}
        self._status_questions: dict[str, str] = {}  # by protocol
        self._began_s = robot_time.now_s()

    def keep_time(self, at_s: float | None) -> None:
        if at_s is not None:
            self._time.wait(max(0.0, self._began_s + at_s - self._time.now_s()))

    def asked(self, name: str) -> str:
        client = self._clients.get(name)
        return client.last if client else ""

    def play(self, step: Steps) -> str:
        """Carry out a step; returns the difference in words."""
        name = step.step.client
        if isinstance(step, Leaves):
            if name in self._clients:
                self._clients.pop(name).wire.close()
            return ""
        if name not in self._clients:
            self._clients[name] = self._connected(step.step.protocol)
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
                self._wait(client, step)
                return ""

    def unread(self) -> Iterator[tuple[int, str, str]]:
        """Unexpected data that clients have received, with their last lines."""
        for client in self._clients.values():
            if client.wire.unread:
                yield client.line, client.last, client.wire.unread

    def close(self) -> None:
        for client in self._clients.values():
            client.wire.close()

    def _connected(self, protocol: str) -> _Client:
        speech = SPEECH[protocol]
        return _Client(speech.connect(self._host, self._ports[protocol], self._timeout_s), speech)

    def _say(self, client: _Client, text: str) -> None:
        try:
            line = client.speech.filled(text, client.heard)
            client.wire.send(client.speech.sent(line))
        except (NoReply, ValueError) as fault:
            client.last = text
            raise _OutOfStep(str(fault)) from None
        client.said.append(line)

    def _hear(self, client: _Client, expected: Answered) -> str:
        client.last = client.said.popleft()
        reply = self._reply(client)
        found = client.speech.deviation(expected, reply, client.heard)
        client.heard[client.speech.topic(client.last)] = reply
        return found

    def _wait(self, client: _Client, wait: Wait) -> None:
        if wait.seconds is not None:
            self._time.wait(wait.seconds)
            return
        question = self._status_question(wait.step.protocol)
        deadline_s = self._time.now_s() + STOPPED_WITHIN_S
        while self._is_moving(client, question):
            if self._time.now_s() > deadline_s:
                raise _OutOfStep(f"still moving after {STOPPED_WITHIN_S:g} s")
            self._time.wait(POLL_PERIOD_S)

    def _status_question(self, protocol: str) -> str:
        if protocol not in self._status_questions:
            self._status_questions[protocol] = SPEECH[protocol].ask_status(self._transcript)
        return self._status_questions[protocol]

    def _is_moving(self, client: _Client, question: str) -> bool:
        self._say(client, question)
        client.last = client.said.popleft()
        try:
            return client.speech.is_moving(question, self._reply(client))
        except ValueError as fault:
            raise _OutOfStep(str(fault)) from None

    def _reply(self, client: _Client) -> str:
        try:
            return client.wire.reply()
        except NoReply as fault:
            raise _OutOfStep(str(fault)) from None
