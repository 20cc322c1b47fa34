"""Parts: how far they reach, how they lie, what they weigh."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import IDENTITY, Frame, Rotation
from iiwa_sim.handling.part import Part, Z
from tests.handling.scenes import BALL, BLOCK, PIN

SHAPES = [
    Box(0.02, 0.03, 0.05),
    Box(0.1, 0.01, 0.002),
    Cylinder(0.03, 0.05),
    Cylinder(0.05, 0.01),
    Sphere(0.04),
]
angles = st.floats(-3.1, 3.1)
rotations = st.builds(lambda a, b, c: Frame(0, 0, 0, a, b, c).to_transform().rotation, angles, angles, angles)
shapes = st.sampled_from(SHAPES)


def skin(shape: Box | Cylinder | Sphere) -> np.ndarray:
    """Many places of its surface, those that reach farthest among them."""
    turns = np.linspace(0.0, 2.0 * np.pi, 721)
    if isinstance(shape, Box):
        return np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(shape)
    if isinstance(shape, Cylinder):
        rim = np.stack([np.cos(turns), np.sin(turns)], axis=1) * shape.radius
        return np.vstack(
            [np.column_stack([rim, np.full(len(rim), z)]) for z in (-shape.half_z, shape.half_z)]
        )
    rings = [
        np.column_stack(
            [np.sin(t) * np.cos(turns), np.sin(t) * np.sin(turns), np.full(len(turns), np.cos(t))]
        )
        for t in np.linspace(0.0, np.pi, 181)
    ]
    return shape.radius * np.vstack(rings)


def part_of(shape: Box | Cylinder | Sphere) -> Part:
    return Part("it", shape, 0.7, 0.5, 1e5)


@given(shape=shapes, rotation=rotations, axis=st.integers(0, 2))
def test_it_reaches_as_far_as_its_skin(shape: Box | Cylinder | Sphere, rotation: Rotation, axis: int) -> None:
    farthest = (skin(shape) @ np.array(rotation).reshape(3, 3).T)[:, axis].max()
    assert part_of(shape).reach(rotation, axis) == pytest.approx(farthest, rel=1e-3)


@given(shape=shapes, rotation=rotations)
def test_put_down_it_lies_level_and_no_higher(shape: Box | Cylinder | Sphere, rotation: Rotation) -> None:
    part = part_of(shape)
    lies = part.laid(rotation)
    turned = np.array(lies).reshape(3, 3)
    assert turned @ turned.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(turned) == pytest.approx(1.0)
    assert part.reach(lies, Z) <= part.reach(rotation, Z) + 1e-9
    assert part.is_level(lies)
    assert part.laid(lies) == pytest.approx(lies, abs=1e-9)


def test_what_stands_upright_stays_so() -> None:
    turned = Frame(0, 0, 0, 0.7, 0.0, 0.0).to_transform().rotation
    for part in (BLOCK, PIN, BALL):
        assert part.laid(turned) == turned
    tilted = Frame(0, 0, 0, 0.0, 0.3, 0.0).to_transform().rotation
    assert not BLOCK.is_level(tilted)
    assert not PIN.is_level(tilted)
    assert BALL.is_level(tilted)
    on_its_side = Frame(0, 0, 0, 0.4, 1.5707963267948966, 0.0).to_transform().rotation
    assert PIN.is_level(on_its_side)
    assert PIN.reach(PIN.laid(on_its_side), Z) == pytest.approx(0.015)


@pytest.mark.parametrize("shape", SHAPES)
def test_its_inertia_is_that_of_its_volume(shape: Box | Cylinder | Sphere) -> None:
    """Summed over a grid."""
    part = part_of(shape)
    if isinstance(shape, Box):
        box = shape
    elif isinstance(shape, Cylinder):
        box = Box(shape.radius, shape.radius, shape.half_z)
    else:
        box = Box(shape.radius, shape.radius, shape.radius)
    line = (np.arange(80) + 0.5) / 40.0 - 1.0
    places = np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3) * np.array(box)
    if isinstance(shape, Sphere):
        places = places[(places**2).sum(axis=1) <= shape.radius**2]
    elif isinstance(shape, Cylinder):
        places = places[np.hypot(places[:, 0], places[:, 1]) <= shape.radius]
    second = part.mass_kg * (places.T @ places) / len(places)
    moments = part.moments(IDENTITY)
    assert moments.mass == part.mass_kg
    size = hypot(*np.diag(second))
    assert (moments.xx, moments.yy, moments.zz) == pytest.approx(np.diag(second), abs=0.01 * size)
    assert moments[1:4] == (0.0, 0.0, 0.0)
