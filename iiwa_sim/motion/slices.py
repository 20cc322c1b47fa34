"""Work in slices: a generator that yields where it may be interrupted, and returns its result.

Planning takes milliseconds; a tick, which delays commands, has room for one slice of it.
"""

from collections.abc import Generator
from typing import TypeVar

T = TypeVar("T")

Slices = Generator[None, None, T]
