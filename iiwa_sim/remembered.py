"""A dialogue that is remembered, for tests that ask what a driver has said."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from iiwa_sim.protocols.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.protocols.krc4_xml import from_short, is_short, load_krc4_table
from iiwa_sim.protocols.ports import KRC4
from iiwa_sim.protocols.table import load_table

MOST = 100_000
"""Exchanges that are remembered; one that is repeated, as of a driver that polls, counts once."""

SHOWN = 12
"""Commands that the message of an assertion names."""


class Exchange(NamedTuple):
    """A line of a client, or a KRC4 message in its short form, and the reply to it."""

    session: str
    """HOST:PORT of the client."""
    command: str
    """The name of the command as in protocol/iiwa.toml, or of a KRC4 message such as GOA; else the line."""
    line: str
    """The line as the driver said it, without its line end."""
    reply: str
    """The reply as the robot gave it; what a fault on the wire made of it is not told here."""


@dataclass
class _Repeated:
    exchange: Exchange
    times: int = 1


class RememberedDialogue(Dialogue):
    """What is said in all protocols; from `remember` on, it can be asked for.

    The methods may be called from any thread. A line is remembered before its reply is on its way: who has
    the reply finds the line here.
    """

    def __init__(self, tick: Callable[[], int]) -> None:
        """`tick` gives the robot's present one."""
        super().__init__(tick)
        self._memory: list[_Repeated] | None = None
        self._protocols: dict[str, str] = {}
        self._said: dict[str, str] = {}  # the line of each client that waits for its reply
        self._overflown = False

    def remember(self) -> None:
        """Remembers from now on; the fixture `iiwa` has begun to already."""
        if self._memory is None:
            self._memory = []
            self.listeners.append(self._hear)

    def forget(self) -> None:
        """Forgets what was said so far and goes on remembering: for what comes before a test's own matter."""
        self.remember()
        self._memory = []
        self._overflown = False

    def exchanges(self) -> list[Exchange]:
        """All lines and their replies, in the order in which they were carried out.

        Raises RuntimeError where `remember` was not called, or more was said than is remembered (100,000,
        where one that is repeated without another between counts once).
        """
        if self._memory is None:
            raise RuntimeError("nothing is remembered: call dialogue.remember() before the driver connects")
        if self._overflown:
            raise RuntimeError(f"more than {MOST} exchanges: call dialogue.forget() ahead of what counts")
        return [each.exchange for each in list(self._memory) for _ in range(each.times)]

    def commands(self) -> list[str]:
        """The names of all commands that were said, in their order: `["hello", "lin move", "get status"]`.

        A line that is no command stands there as it was said. Raises RuntimeError as `exchanges`.
        """
        return [each.command for each in self.exchanges()]

    def lines(self) -> list[str]:
        """All lines that were said, in their order, as they came. Raises RuntimeError as `exchanges`."""
        return [each.line for each in self.exchanges()]

    def times_said(self, what: str) -> int:
        """How often a command was said, by its name, or a whole line, by its text.

        Letter case and blanks do not count. Raises ValueError for what was never said and is no command
        either, and RuntimeError as `exchanges`.
        """
        wanted = _normal(what)
        times = sum(wanted in (_normal(each.command), _normal(each.line)) for each in self.exchanges())
        if not times and ":" not in what and wanted not in _names():
            raise ValueError(f"'{what}': expected the name of a command, such as lin move, or a whole line")
        return times

    def assert_said(self, what: str, times: int | None = None) -> None:
        """Fails, with an AssertionError that tells what was said, where a command was not.

        `what` is its name, or a whole line. With `times` exactly so often, 0 for never; without it at least
        once. Raises ValueError and RuntimeError as `times_said`.
        """
        found = self.times_said(what)
        if found != times if times is not None else not found:
            wanted = "at least once" if times is None else _times(times)
            raise AssertionError(f"expected '{what}' {wanted}, was said {_times(found)}; {self._summary()}")

    def _summary(self) -> str:
        counted = Counter(self.commands())
        if not counted:
            return "nothing was said"
        told = [f"{name} ({_times(count)})" for name, count in list(counted.items())[:SHOWN]]
        more = f", and {len(counted) - SHOWN} more" if len(counted) > SHOWN else ""
        return f"said were {', '.join(told)}{more}"

    def _hear(self, said: DialogueLine) -> None:
        session = said.session
        if said.direction is Direction.EVENT:
            if said.text == "connected":
                self._protocols[session] = said.protocol
        elif said.direction is Direction.FROM_CLIENT:
            self._said[session] = said.text
        elif said.direction is Direction.TO_CLIENT and session in self._said:
            line = self._said.pop(session)
            command = _command(line, self._protocols.get(session, ""))
            self._add(Exchange(session, command, line, said.text))

    def _add(self, exchange: Exchange) -> None:
        memory = self._memory
        assert memory is not None  # it listens
        if memory and memory[-1].exchange == exchange:
            memory[-1].times += 1
        elif len(memory) < MOST:
            memory.append(_Repeated(exchange))
        else:
            self._overflown = True


def _command(line: str, protocol: str) -> str:
    if protocol == KRC4:
        return _message(line)
    command = load_table("iiwa").find(line.partition(":")[0].encode())
    return line if command is None else command.name


def _message(line: str) -> str:
    """The name of a KRC4 message; the line where it is none of the table."""
    if is_short(line):
        number = from_short(line).values.get("I1", "")
        known = load_krc4_table().get(int(number)) if number.isdecimal() else None
        if known is not None:
            return known.tag
    return line


def _names() -> set[str]:
    messages = load_krc4_table().values()
    return {*load_table("iiwa").commands, *(each.tag.lower() for each in messages)}


def _normal(text: str) -> str:
    return " ".join(text.lower().replace(":", " : ").split())


def _times(count: int) -> str:
    return "once" if count == 1 else "never" if count == 0 else f"{count} times"
