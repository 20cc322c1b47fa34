"""Compares a reply of the iiwa's protocol with the expected one."""

import math
import re
from collections.abc import Mapping

from iiwa_sim.transcript.lines import Answered, Compare

_HEARD = re.compile(r"\{(?P<command>[a-z ]+?)(?: (?P<place>\d+))?\s*(?:\+(?P<more>[^{}]*))?\}")


def deviation(expected: Answered, reply: str, heard: Mapping[str, str]) -> str:
    """The difference in words; empty if there is none. `heard` is that of `filled`."""
    if expected.compare is Compare.ANY:
        return ""
    try:
        wanted = filled(expected.text, heard)
    except ValueError as fault:
        return str(fault)
    if expected.compare is Compare.EXACT:
        wanted = wanted.replace("\\x7b", "{")
        return "" if reply == wanted else f"expected '{wanted}', got '{reply}'"
    if not all(map(_is_number, wanted.split())):
        return (
            ""
            if _near(expected.within, wanted.split(), reply.split())
            else (f"expected '{wanted}', its numbers within {expected.within:g}, got '{reply}'")
        )
    try:
        wanted_numbers, numbers = _numbers(wanted), _numbers(reply)
    except ValueError as fault:
        return f"expected '{wanted}', got '{reply}': {fault}"
    if len(numbers) != len(wanted_numbers):
        return f"expected {len(wanted_numbers)} numbers, got {len(numbers)}: '{reply}'"
    for place, (number, other) in enumerate(zip(numbers, wanted_numbers, strict=True), 1):
        if not abs(number - other) <= expected.within:
            return f"number {place} is {number}, expected {other} within {expected.within:g}: '{reply}'"
    return ""


def filled(text: str, heard: Mapping[str, str]) -> str:
    """Text with `{get ...}` replaced by the last replies, which `heard` has by command. Raises ValueError."""

    def last(found: re.Match[str]) -> str:
        reply = heard.get(found["command"])
        if reply is None:
            raise ValueError(f"'{found['command']}' has not been asked yet")
        if found["place"]:
            words = reply.split()
            if not 1 <= int(found["place"]) <= len(words):
                raise ValueError(f"expected {found['place']} numbers or more, got '{reply}'")
            reply = words[int(found["place"]) - 1]
        if found["more"] is None:
            return reply
        numbers, more = _numbers(reply), _numbers(found["more"])
        if len(numbers) != len(more):
            raise ValueError(f"expected {len(numbers)} numbers behind the + of {found[0]}, got {len(more)}")
        return " ".join(f"{number + other:.9f}" for number, other in zip(numbers, more, strict=True))

    return _HEARD.sub(last, text)


def _near(within: float, wanted: list[str], words: list[str]) -> bool:
    """Whether words are equal to those that are wanted, but for numbers, which may differ."""
    return len(words) == len(wanted) and all(
        abs(float(word) - float(other)) <= within if _is_number(word) and _is_number(other) else word == other
        for word, other in zip(words, wanted, strict=True)
    )


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def _numbers(text: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        raise ValueError(f"expected numbers, got '{text}'") from None
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"expected finite numbers, got '{text}'")
    return numbers
