"""KRC4 messages for clients: ten integers I0 to I9 and ten reals R0 to R9 out, as many in.

I0 is the id of a message, which its reply repeats; I1 is that of the command, which a refusal repeats with a
minus, with the number of the error in I2.
"""

from collections.abc import Callable, Iterable, Sequence
from operator import index
from typing import NamedTuple, TypeVar

from iiwa_sim.client._generated.krc4_numbers import COMMANDS, ERRORS
from iiwa_sim.client.errors import Krc4Error
from iiwa_sim.client.exchange import Conversation, Language, Request, refuse_endless
from iiwa_sim.client.readers import integer, number, state
from iiwa_sim.client.xml_replies import XmlReplies

REGISTERS = 10
"""Integers in a message, and as many reals."""
LARGEST_INTEGER = 2**31 - 1
SMALLEST_INTEGER = -(2**31)

_INTEGERS = tuple(f"I{place}" for place in range(REGISTERS))
_REALS = tuple(f"R{place}" for place in range(REGISTERS))

T = TypeVar("T")


class Message(NamedTuple):
    """A request without its id."""

    command: str
    integers: tuple[int, ...] = ()
    """Integers from I2 on."""
    reals: tuple[float, ...] = ()
    """Reals from R0 on."""

    def __repr__(self) -> str:
        return " ".join(map(str, (self.command, *self.integers, *self.reals)))


class Reply(NamedTuple):
    """A reply with all its values."""

    integers: tuple[int, ...]
    reals: tuple[float, ...]

    def __repr__(self) -> str:
        integers = [f" I{place}={value}" for place, value in enumerate(self.integers) if value or place < 2]
        reals = [f" R{place}={value}" for place, value in enumerate(self.reals) if value]
        return "".join(["Res", *integers, *reals])


def message(
    read: Callable[[Reply], T], command: str, integers: Sequence[int] = (), reals: Sequence[float] = ()
) -> Request[Message, Reply, T]:
    """A request with integers from I2 and reals from R0 on.

    Raises ValueError for reals that are not finite, and for integers of more than 32 bit.
    """
    refuse_endless(command, reals)
    whole = tuple(_whole(command, value) for value in integers)
    return Request(Message(command, whole, tuple(map(float, reals))), read)


def nothing(_: Reply) -> None:
    """Reads a reply without values."""


def flag(place: int) -> Callable[[Reply], bool]:
    """A reader for an integer that is 1 or 0."""
    return lambda reply: state(str(reply.integers[place]))


def real(place: int) -> Callable[[Reply], float]:
    """A reader for one real."""
    return lambda reply: reply.reals[place]


def reals(make: Callable[[Iterable[float]], T], count: int) -> Callable[[Reply], T]:
    """A reader for exactly `count` reals from R0 on: raises ValueError for a robot with more axes."""

    def read(reply: Reply) -> T:
        if any(reply.reals[count:]):
            raise ValueError(reply)
        return make(reply.reals[:count])

    return read


def as_axes(axes: int) -> int:
    """The number of axes of a robot. Raises ValueError if they do not fit in a message."""
    if not 1 <= axes <= REGISTERS:
        raise ValueError(f"axes: expected 1 to {REGISTERS}, got {axes}")
    return axes


class MessageConversation(Conversation[Message, Reply]):
    """The requests and answers of one connection in messages, each with its own id."""

    def __init__(self, last_id: int = 0) -> None:
        self._replies = XmlReplies()
        super().__init__(self._replies)
        self._id = last_id

    def _written(self, said: Message) -> bytes:
        self._id = 1 + self._id % LARGEST_INTEGER
        integers = (self._id, COMMANDS[said.command], *said.integers)
        # All twenty values: other servers may not take an absent one for 0.
        values = dict.fromkeys(_INTEGERS, "0") | dict.fromkeys(_REALS, "0.0")
        values |= zip(_INTEGERS, map(str, integers), strict=False)
        values |= zip(_REALS, map(repr, said.reals), strict=False)
        return f"<Cmd>{''.join(f'<{name}>{text}</{name}>' for name, text in values.items())}</Cmd>".encode()

    def _answer(self, said: Message) -> Reply | None:
        values = self._replies.take()
        if values is None:
            return None
        reply = _reply(values)
        command = COMMANDS[said.command]
        if reply.integers[:2] == (self._id, -command):
            code = reply.integers[2]
            why = ERRORS.get(code, "its log has the reason")
            raise Krc4Error(f"the robot refused {said!r} with error {code}: {why}", code)
        if reply.integers[:2] != (self._id, command):
            raise ValueError(f"{reply!r}, expected I0={self._id} I1={command}")
        return reply


def _reply(values: dict[str, str]) -> Reply:
    if set(values) != {*_INTEGERS, *_REALS}:
        names = ", ".join(values)[:200]
        raise ValueError(f"the values {names or 'of none'}, expected I0 to I9 and R0 to R9")
    try:
        integers = tuple(integer(values[name]) for name in _INTEGERS)
        return Reply(integers, tuple(number(values[name]) for name in _REALS))
    except ValueError as fault:
        raise ValueError(f"a value that is no number: {str(fault)[:80]}") from None


def _whole(command: str, value: int) -> int:
    try:
        whole = index(value)
    except TypeError:
        raise ValueError(f"{command}: expected whole numbers, got {value!r}") from None
    if not SMALLEST_INTEGER <= whole <= LARGEST_INTEGER:
        raise ValueError(f"{command}: expected numbers of 32 bit, got {whole}")
    return whole


KRC4 = Language(MessageConversation, message(flag(2), "FIN"))
"""The KRC4 message protocol."""
