"""A fault in a robot's folder."""

from __future__ import annotations

from iiwa_sim.wording import harmless, shortened

LONGEST_VALUE = 60
"""Characters of a key or a value that a message shows."""
LONGEST_EXPECTED = 400
"""Characters of what was expected, which may cite paths and names, that a message shows."""


class RobotFault(Exception):
    """A robot cannot be used as its folder describes it.

    The message is one line that names the file, the key, its value and what was expected.
    """

    def __init__(self, file: str, key: str, value: object, expected: str) -> None:
        place = f"{file}: {_shown(key)} = {_shown(value)}" if key else file
        wanted = shortened(" ".join(expected.split()), LONGEST_EXPECTED)
        super().__init__(harmless(f"{place}: expected {wanted}"))


def _shown(value: object) -> str:
    try:
        return shortened(str(value), LONGEST_VALUE)
    except (ValueError, RecursionError):  # an integer of more digits than Python prints, lists in lists
        return f"a very long {type(value).__name__}"
