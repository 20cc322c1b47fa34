"""Compares a KRC4 reply with the expected one."""

from collections.abc import Mapping

from iiwa_sim.protocols.krc4_xml import REPLY, Message, is_short, short_reply
from iiwa_sim.transcript.krc4 import filled, understood
from iiwa_sim.transcript.lines import Answered, Compare


def deviation(expected: Answered, reply: str, heard: Mapping[str, str]) -> str:
    """The difference in words; empty if there is none. `heard` is that of `filled`.

    Integers, ids among them, have to be equal, reals within the tolerance. A verbatim reply has to be equal.
    """
    if expected.compare is Compare.ANY:
        return ""
    try:
        wanted = filled(expected.text, heard)
    except ValueError as fault:
        return str(fault)
    if expected.compare is Compare.EXACT and not is_short(wanted):
        wanted = wanted.replace("\\x7b", "{")
        return "" if reply == wanted else f"expected '{wanted}', got '{reply}'"
    other = understood(wanted, REPLY)
    try:
        found = understood(reply, REPLY)
    except ValueError as broken:
        return f"expected '{_shown(other)}', got '{reply}': {broken}"
    if found.fault:
        return f"expected '{_shown(other)}', got '{reply}': {found.fault}"
    return _difference(other, found, expected.within if expected.compare is Compare.NUMBERS else None)


def _difference(expected: Message, found: Message, within: float | None) -> str:
    """The difference of two rows of numbers; with `within` None they have to be equal."""
    if found.integers != expected.integers or (within is None and found.reals != expected.reals):
        return f"expected '{_shown(expected)}', got '{_shown(found)}'"
    for place, (real, other) in enumerate(zip(found.reals, expected.reals, strict=True)):
        if within is not None and not abs(real - other) <= within:
            return f"R{place} is {real}, expected {other} within {within:g}: '{_shown(found)}'"
    return ""


def _shown(message: Message) -> str:
    return short_reply(message.integers, message.reals)
