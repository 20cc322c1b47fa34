"""A fault in a robot's folder."""

from __future__ import annotations


class RobotFault(Exception):
    """A robot cannot be used as its folder describes it.

    The message is one line that names the file, the key, its value and what was expected.
    """

    def __init__(self, file: str, key: str, value: object, expected: str) -> None:
        place = f"{file}: {key} = {value}" if key else f"{file}"
        super().__init__(" ".join(f"{place}: expected {expected}".split()))
