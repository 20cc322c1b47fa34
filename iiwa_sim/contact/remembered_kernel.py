"""What is remembered of places at which bodies meet, from one tick to the next: a table of numbers by a key.

A key is made of the numbers of both bodies and of the place, which stay the same as long as the cell does.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np

_MOST_PLACES = cython.declare(cython.longlong, 64)  # of a pair
_MOST_BODIES = cython.declare(cython.longlong, 1048576)
# Of a place: the way out, where it was from the middle of the body, how far it rubbed, how deep it pressed,
# and how deep it was in there without pressing.
_NUMBERS = cython.declare(cython.Py_ssize_t, 11)


@cython.cclass
class Remembered:
    """A table of open addresses; the arrays are declared in the .pxd."""

    def __init__(self) -> None:
        """Nothing is remembered."""
        self.forget()

    @cython.cfunc
    @cython.exceptval(check=False)
    def _find(self, key: cython.longlong) -> cython.Py_ssize_t:
        """Where in the table a key is, or would be."""
        mask: cython.Py_ssize_t = self._table - 1
        pair: cython.longlong = key // _MOST_PLACES
        slot: cython.Py_ssize_t = (31 * pair + 1009 * (pair // _MOST_BODIES) + key) & mask
        while self._keys[slot] != -1 and self._keys[slot] != key:
            slot = (slot + 1) & mask
        return slot

    @cython.cfunc
    @cython.exceptval(check=False)
    def _has_come_in(self, key: cython.longlong) -> cython.bint:
        """Whether it is remembered by which way a place has come into a body."""
        slot: cython.Py_ssize_t = self._find(key)
        if self._keys[slot] == -1:
            return False
        return self._memory[slot, 0] != 0.0 or self._memory[slot, 1] != 0.0 or self._memory[slot, 2] != 0.0

    @cython.cfunc
    @cython.exceptval(check=False)
    def _forget_place(self, key: cython.longlong) -> cython.void:
        """Nothing is remembered of a place."""
        slot: cython.Py_ssize_t = self._find(key)
        if self._keys[slot] != -1:
            for k in range(_NUMBERS):
                self._memory[slot, k] = 0.0

    @cython.cfunc
    def _sift(self) -> object:
        """Make room in the table: what has gone is dropped, and where little has, it gets larger."""
        self.restore(self.kept())
        return None

    def kept(self) -> Any:
        """What is remembered of all places, to be brought back."""
        keys, memory = np.asarray(self._keys), np.asarray(self._memory)
        there = (keys != -1) & memory[:, :3].any(axis=1)
        return keys[there].tobytes(), memory[there].tobytes()

    def restore(self, kept: Any) -> None:
        """Remember that again."""
        keys = np.frombuffer(kept[0], dtype=np.int64)
        memory = np.frombuffer(kept[1]).reshape(len(keys), _NUMBERS)
        size = 1024
        while size < 4 * len(keys):
            size *= 2
        self._table = size
        self._keys, self._memory = np.full(size, -1, dtype=np.int64), np.zeros((size, _NUMBERS))
        self._used = len(keys)
        n: cython.Py_ssize_t
        slot: cython.Py_ssize_t
        for n in range(len(keys)):
            slot = self._find(keys[n])
            self._keys[slot] = keys[n]
            for k in range(_NUMBERS):
                self._memory[slot, k] = memory[n, k]

    def parted(self, part: int) -> None:
        """A part has been somewhere else: of where it met others nothing is remembered."""
        keys = np.asarray(self._keys)
        pairs = keys // _MOST_PLACES
        its = (pairs // _MOST_BODIES == part) | (pairs % _MOST_BODIES == part)
        np.asarray(self._memory)[its & (keys != -1)] = 0.0

    def forget(self) -> None:
        """No body has met another."""
        self.restore((b"", b""))

    @cython.cfunc
    @cython.exceptval(check=True)
    def _room_for(self, key: cython.longlong) -> cython.Py_ssize_t:
        """Where what is remembered under a key is to be noted."""
        slot: cython.Py_ssize_t = self._find(key)
        if self._keys[slot] == -1:
            if 2 * self._used >= self._table:
                self._sift()
                slot = self._find(key)
            self._keys[slot] = key
            self._used += 1
        return slot
