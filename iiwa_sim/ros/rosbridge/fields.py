"""The fields of rosbridge's operations: what is read of a message, and how a wrong one is refused."""

from collections.abc import Sequence
from typing import Any, NoReturn

from iiwa_sim.ros.arm.messages import ros1_name
from iiwa_sim.ros.rmi.message_text import BadMessage
from iiwa_sim.ros.rmi.node import Message
from iiwa_sim.ros.rosbridge.introspection import rooted
from iiwa_sim.wording import harmless, shortened

LONGEST_ID = 200
"""Letters of a subscription's id."""
_LONGEST_SHOWN = 200


class Misuse(Exception):
    """An operation is refused. The message is for the client."""


def topic_of(message: Message) -> str:
    """The topic that an operation is about, from the root on."""
    topic = message.get("topic")
    if not isinstance(topic, str):
        raise Misuse("topic: expected a name")
    return rooted(topic)


def check_type(topic: str, kind: str, told: Any) -> None:
    if told not in (None, "", "*", kind) and ros1_name(str(told)) != ros1_name(kind):
        raise Misuse(f"{topic} is of type {kind}, not {shown(told)}")


def number_of(message: Message, field: str) -> float:
    value = message.get(field, 0)
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 2**31:
        _expected_number(field)
    return float(value)


def _expected_number(field: str) -> NoReturn:
    raise Misuse(f"{field}: expected a number from 0 on")


def compression_of(message: Message, offered: tuple[str, ...]) -> str:
    wanted = message.get("compression")
    if wanted is None:
        return offered[0]
    if wanted not in offered:
        raise Misuse(f"compression {shown(wanted)}: expected {', '.join(offered)}")
    return str(wanted)


def check_whole(message: Message) -> None:
    if message.get("fragment_size") is not None:
        raise Misuse("fragment_size: expected none, messages are sent whole")


def key_of(message: Message) -> Any:
    """The id by which a subscription of a topic is known."""
    identifier = message.get("id")
    if isinstance(identifier, str) and len(identifier) > LONGEST_ID:
        raise Misuse(f"id: expected up to {LONGEST_ID} letters, got {len(identifier)}")
    return identifier if isinstance(identifier, str | int | float) else None


def request_of(names: Sequence[str], arguments: Any) -> Any:
    """The request as a message: arguments by name, or in the order of the fields."""
    if not isinstance(arguments, list):
        return {} if arguments is None else arguments
    if len(arguments) > len(names):
        raise BadMessage(f"expected up to {len(names)} arguments, got {len(arguments)}")
    return dict(zip(names, arguments, strict=False))


def shown(what: Any) -> str:
    text = what.decode("utf-8", "backslashreplace") if isinstance(what, bytes) else str(what)
    return shortened(harmless(text), _LONGEST_SHOWN)
