"""What presses on a part that lies, and what it lies on, in numbers: springs, and friction."""

from __future__ import annotations

from typing import NamedTuple


class Below(NamedTuple):
    """What a part lies on."""

    stiffness: float
    """N/m"""
    depth: float
    """How deep it lies in it (m)."""
    weight_n: float
    """Of the part, which the spring below it carries."""
    above_n: float
    """Of what lies on it."""
    friction: float
    points: tuple[tuple[float, float], ...]
    """Four, at which it rubs, from its middle (m)."""
    wound: tuple[float, ...]
    """How far the springs of friction there are wound, x and y of each (m)."""


class Pressing(NamedTuple):
    """One that presses on a part."""

    along: tuple[float, float, float, float]
    """By how much the depth grows with each of the four numbers of a way."""
    depth: float
    """m; less than 0 for one that does not reach it."""
    stiffness: float
    """N/m"""
    friction: float
    """Coefficient; 0 for none."""
    holding: float
    """Stiffness (N/m) of friction's spring."""
    lever: tuple[float, float]
    """From the middle of the part, in the plane (m)."""
    out: tuple[float, float, float]
    """Unit vector across which it rubs."""
    rubbed: tuple[float, float, float]
    """How far it has gone along the part (m), as friction holds that."""
