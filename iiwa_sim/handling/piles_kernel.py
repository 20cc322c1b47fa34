"""Piles of parts: what lies on each part, and on that, and how heavy all that is.

**Cost.** Each part of a tower carries all above it, so whoever asks each of them for that has as many answers
as the square of its height. Here an answer is a stretch of one list, which is made when other parts lie.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder
from iiwa_sim.frames import Rotation
from iiwa_sim.handling.falling import Body
from iiwa_sim.handling.part import Part


@cython.cclass
class Piles:
    """The piles of a cell, with its parts by their numbers; the attributes are declared in the .pxd."""

    def __init__(self, names: Iterable[str]) -> None:
        """These are the parts, and nothing is known of what they lie on."""
        self.names = list(names)
        self.numbers = {name: number for number, name in enumerate(self.names)}
        count, least = len(self.names), max(len(self.names), 1)
        self._known, self._count = False, 0
        self._order, self._left = np.zeros(least, dtype=np.intp), np.zeros(least, dtype=np.intp)
        self._first, self._end = np.zeros(least, dtype=np.intp), np.zeros(least, dtype=np.intp)
        self._upper, self._next = np.zeros(least, dtype=np.intp), np.zeros(least, dtype=np.intp)
        self._mass = np.zeros((least, 4))
        self._turned: Any = [None] * count

    def change(self) -> None:
        """Parts lie on others than before."""
        self._known = False

    def look(self, bodies: Mapping[str, Body], lying: Sequence[str]) -> None:
        """Find what lies on what, unless that is known."""
        if not self._known:
            self._find(bodies, lying)

    @cython.cfunc
    def _find(self, bodies: Any, lying: Any) -> object:
        """Put each part right before all that lies on it."""
        n: cython.Py_ssize_t
        below: cython.Py_ssize_t
        numbers = self.numbers
        for n in range(self._upper.shape[0]):
            self._upper[n] = self._next[n] = -1
            self._first[n] = self._end[n] = 0
        lowest: list[int] = []
        # From the last to the first: so the first of those on the same part is found first.
        for name in reversed(lying):
            n, below = numbers[name], numbers.get(bodies[name].on, -1)
            if below < 0:
                lowest.append(n)
            else:
                self._next[n], self._upper[below] = self._upper[below], n
        there = set(lying)
        for name in self.names:
            n = numbers[name]
            if self._upper[n] >= 0 and name not in there:  # it has just ceased to lie
                lowest.append(n)
        self._count, self._known = 0, True
        for each in lowest:
            self._climb(each)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _climb(self, lowest: cython.Py_ssize_t) -> cython.void:
        """Put a part and all that lies on it in order."""
        n: cython.Py_ssize_t = lowest
        below: cython.Py_ssize_t = 0  # parts from the lowest one up to what carries this one
        while n >= 0:
            self._order[self._count] = n
            self._count += 1
            self._first[n] = self._end[n] = self._count
            if self._upper[n] >= 0:
                self._left[below] = n
                below += 1
                n = self._upper[n]
                continue
            n = self._next[n]
            while n < 0 and below > 0:
                below -= 1
                n = self._left[below]
                self._end[n] = self._count
                n = self._next[n]

    def above(self, number: int) -> list[str]:
        """The names of what lies on a part, and on that."""
        n: cython.Py_ssize_t = number
        return [self.names[self._order[at]] for at in range(self._first[n], self._end[n])]

    def _above(self, number: int) -> tuple[int, int]:
        """Where what lies on a part, and on that, begins and ends."""
        n: cython.Py_ssize_t = number
        return self._first[n], self._end[n]

    def all_above(self, numbers: Iterable[int]) -> set[str]:
        """The names of what lies on any of these parts, and on that."""
        found: set[str] = set()
        end: cython.Py_ssize_t = 0
        first: cython.Py_ssize_t
        last: cython.Py_ssize_t
        for first, last in sorted([self._above(each) for each in numbers]):
            if last > end:  # else it is on one that has been asked for
                end = last
                for at in range(first, last):
                    found.add(self.names[self._order[at]])
        return found

    def weigh(self, number: int, body: Body) -> None:
        """A part is there, and turned like that."""
        n: cython.Py_ssize_t = number
        part, (rotation, place) = body.part, body.pose
        if self._turned[n] is not rotation:
            self._turned[n] = rotation
            self._mass[n, 0], self._mass[n, 1] = part.mass_kg, _about_the_vertical(part, rotation)
        self._mass[n, 2], self._mass[n, 3] = place[0], place[1]

    def carried(self, number: int) -> tuple[float, float]:
        """What lies on a part, and on that, as it was weighed: its mass (kg), and its moment of inertia (kg
        m^2) about the vertical through the part's middle."""
        n: cython.Py_ssize_t = number
        k: cython.Py_ssize_t
        m = self._mass
        mass: cython.double = 0.0
        about: cython.double = 0.0
        for at in range(self._first[n], self._end[n]):
            k = self._order[at]
            x: cython.double = m[k, 2] - m[n, 2]
            y: cython.double = m[k, 3] - m[n, 3]
            mass += m[k, 0]
            about += m[k, 1] + m[k, 0] * (x * x + y * y)
        return mass, about


@cython.cfunc
@cython.exceptval(-1.0, check=True)
def _about_the_vertical(part: Part, rotation: Rotation) -> cython.double:
    """Moment of inertia (kg m^2) of a part turned like that, about the vertical through its middle: as
    `Part.moments`, of which it takes two sums."""
    shape = part.shape
    x: cython.double
    y: cython.double
    z: cython.double
    a: cython.double
    b: cython.double
    c: cython.double
    # The integral of the square of the place along each axis of the part, over its mass.
    if isinstance(shape, Box):
        x, y, z = shape
        x, y, z = x * x / 3.0, y * y / 3.0, z * z / 3.0
    elif isinstance(shape, Cylinder):
        x, z = shape
        x, z = x * x / 4.0, z * z / 3.0
        y = x
    else:
        x = shape[0]
        x = y = z = 0.2 * x * x
    # Of what is along the vertical nothing counts.
    a, b, c = rotation[6], rotation[7], rotation[8]
    mass: cython.double = part.mass_kg
    return mass * ((1.0 - a * a) * x + (1.0 - b * b) * y + (1.0 - c * c) * z)
