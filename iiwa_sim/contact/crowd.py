"""Parts that lie, what presses on them, and where they go, in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from iiwa_sim.contact.contact_kernel import Contact
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import NOT_IN
from iiwa_sim.frames import Vector


class LyingPart(NamedTuple):
    """A part that lies, in numbers."""

    solid: Surface
    velocity: tuple[float, float, float, float]
    """m/s three times, rad/s"""
    wound: Sequence[float]
    """How far friction's springs below it are wound: x and y of four places (m); empty for not at all."""
    mass_kg: float
    on: int
    """The number of the body on which it lies: parts first, then surfaces."""
    top: float
    """How high the face is on which it lies (m)."""
    below: float
    """Stiffness of both in a row (N/m)."""
    carries_kg: float
    """What lies on it, and its moment of inertia (kg m^2) about the vertical through the part's middle."""
    carries_kgm2: float


class Spring(NamedTuple):
    """A place at which something presses on what is held."""

    stiffness: float
    """N/m, of both in a row."""
    depth: float
    """By how much it is pressed in (m)."""
    into: Vector
    """The direction in which what is held would press it in further, in the base."""


class PressingBall(NamedTuple):
    """A ball that presses on a part: of the arm, or of what it holds."""

    middle: Vector
    radius: float
    stiffness: float
    """N/m, of both in a row."""
    friction: float = 0.0
    holding: float = 1.0
    """Stiffness (N/m) of friction's spring."""
    rubbed: Vector = (0.0, 0.0, 0.0)
    """How far it has gone along the part (m), as friction holds that."""
    came: Vector = NOT_IN
    """Way by which the ball has come into the part, if that is remembered elsewhere."""
    held: int = -1
    """The number of the held part to which it belongs."""
    place: int = 0
    """Which of the places of that, or of the links of the arm, it is."""
    was_deep: float = -1.0
    """How deep it was a tick ago (m), and its way since (m); less than 0 where that is not known."""
    went: Vector = (0.0, 0.0, 0.0)
    start: Vector = (0.0, 0.0, 0.0)
    """Where a line begins along which such balls lie (m), and its way to the other end: no way where there is
    this one only. The one in the middle of the deepest ones is given."""
    line: Vector = (0.0, 0.0, 0.0)
    unpressed: float = 0.0
    """How deep (m) it is in without pressing."""
    contact: Contact | None = None
    """How a place of the held part touches the part that it presses; None for a ball of the arm itself."""
    turned: Vector = (0.0, 0.0, 0.0)
    """How it has turned in the tick (rad, in the base): it rolls on the part."""


class PartMotion(NamedTuple):
    """A part after a tick."""

    part: int
    way: tuple[float, float, float, float]
    velocity: tuple[float, float, float, float]
    wound: tuple[float, ...]
    pressed: bool
    """Whether anything presses on it."""
