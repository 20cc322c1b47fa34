"""Plays a transcript against a server: sends its lines and compares the replies.

Lines with times are sent at their simulated time since the beginning; other lines, and late ones, as soon as
the line before is done.
"""

import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from iiwa_sim.client.connection import LINE, Connection
from iiwa_sim.client.krc4 import REPLY
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.ports import KRC4
from iiwa_sim.server.listening import host_and_port, why
from iiwa_sim.transcript.lines import Kind, Step, Transcript
from iiwa_sim.transcript.texts import ASK_STATUS, TranscriptFault, deviation, filled, is_moving, sent, topic

TIMEOUT_S = 5.0
STOPPED_WITHIN_S = 60.0
"""Seconds for which `wait stopped` waits."""
POLL_PERIOD_S = 0.01


class Deviation(NamedTuple):
    """A line of the transcript whose outcome differs."""

    line: int
    command: str
    what: str

    def __str__(self) -> str:
        return f"'{self.command}': {self.what}" if self.command else self.what


class Time(NamedTuple):
    """Time of the robot that a transcript is played against; real time by default."""

    now_s: Callable[[], float] = time.monotonic
    wait: Callable[[float], None] = time.sleep


def connected(host: str, port: int, timeout_s: float) -> Connection:
    """Connect to a server. Raises TranscriptFault."""
    try:
        return Connection(host, port, timeout_s)
    except (OSError, ValueError) as fault:  # ValueError: characters that no host name has
        raise TranscriptFault(f"cannot connect to {host_and_port(host, port)}: {why(fault)}") from None


def replay(
    transcript: Transcript,
    host: str,
    port: int | Sequence[int],
    timeout_s: float = TIMEOUT_S,
    clock: Time = Time(),  # noqa: B008 - it does not change
) -> Iterator[Deviation]:
    """Play a transcript; yields each deviation. One after which a client is out of step is the last.

    There is a port for each protocol of the transcript. Waits are in the robot's time, real time by default,
    except for the wait of `timeout_s` for each reply.

    Raises TranscriptFault if the server cannot be reached, if ports and protocols do not match, or if nothing
    is sent: an empty recording must not pass.
    """
    if not any(step.kind is Kind.COMMAND for step in transcript.steps):
        raise TranscriptFault(f"{transcript.name}: expected a line `> command` at least")
    ports = [port] if isinstance(port, int) else port
    if len(ports) != len(transcript.protocols):
        wanted = f"one each for {', '.join(transcript.protocols)}"
        raise TranscriptFault(f"{transcript.name}: number of ports {len(ports)}, expected {wanted}")
    began_s = clock.now_s()
    clients: dict[str, _Client] = {}
    replies = defaultdict[str, dict[str, str]](dict)  # also of clients that leave and come back
    try:
        for step in transcript.steps:
            if step.at_s is not None:
                clock.wait(max(0.0, began_s + step.at_s - clock.now_s()))
            if step.kind is Kind.LEAVES:
                if step.client in clients:
                    clients.pop(step.client).connection.close()
                continue
            if step.client not in clients:
                connection = connected(host, ports[transcript.protocols.index(step.protocol)], timeout_s)
                clients[step.client] = _Client(connection, step.protocol, replies[step.client])
            client = clients[step.client]
            client.line = step.line
            try:
                found = client.play(step, clock)
            except (OSError, ValueError) as fault:
                yield Deviation(step.line, client.last, why(fault))
                return
            if found:
                yield Deviation(step.line, client.last, found)
        for client in clients.values():
            if unread := readable(client.connection.unread.strip()):
                yield Deviation(client.line, client.last, f"more came than was asked for: '{unread}'")
    finally:
        for client in clients.values():
            client.connection.close()


@dataclass
class _Client:
    """A client of the transcript."""

    connection: Connection
    protocol: str
    replies: dict[str, str]
    """The last reply to each command, by topic."""
    pending: deque[str] = field(default_factory=deque)
    """Lines without a reply yet."""
    last: str = ""
    """The last line that was sent or answered."""
    line: int = 0

    def play(self, step: Step, clock: Time) -> str:
        """Carry out a step; returns the difference in words.

        Raises OSError and ValueError if client and server are out of step then.
        """
        if step.kind is Kind.COMMAND:
            self._send(step.text)
        elif step.kind.is_reply:
            return self._compare(step)
        elif step.kind is Kind.WAIT and step.number is None:
            self._wait_until_stopped(clock)
        elif step.kind is Kind.WAIT:
            clock.wait(step.number or 0.0)
        return ""

    def _send(self, text: str) -> None:
        self.last = text
        line = filled(self.protocol, text, self.replies)
        self.connection.send(sent(self.protocol, line))
        self.pending.append(line)

    def _compare(self, expected: Step) -> str:
        self.last = self.pending.popleft()
        reply = self._reply()
        try:
            if expected.kind is Kind.ANY:
                return ""
            wanted = filled(self.protocol, expected.text, self.replies)
            return deviation(self.protocol, wanted, expected.number, reply)
        except ValueError as fault:
            return str(fault)
        finally:
            self.replies[topic(self.protocol, self.last)] = reply

    def _wait_until_stopped(self, clock: Time) -> None:
        deadline_s = clock.now_s() + STOPPED_WITHIN_S
        while True:
            self._send(ASK_STATUS[self.protocol])
            self.pending.clear()
            if not is_moving(self.protocol, self._reply()):
                return
            if clock.now_s() > deadline_s:
                raise TimeoutError(f"still moving after {STOPPED_WITHIN_S:g} s")
            clock.wait(POLL_PERIOD_S)

    def _reply(self) -> str:
        """Return the next reply, escaped."""
        return readable(self.connection.read(REPLY if self.protocol == KRC4 else LINE))
