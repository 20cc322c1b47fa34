"""Surfaces at the TCP: normal force, friction, and no gain of energy."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import (
    Transform,
    Vector,
    apply,
    rotate,
    transform_from_euler,
    transpose,
)
from tests.contact.materials import NO_TOUCH, RADIUS, REST, SHAPES, STIFFNESS, Touch, World, at, surface
from tests.samples import some

Array = NDArray[np.float64]

TICK_S = 0.002
angles = st.floats(-pi, pi)
metres = st.floats(-0.2, 0.2)
speeds = st.floats(-3.0, 3.0)
poses = st.builds(transform_from_euler, metres, metres, metres, angles, angles, angles)


def touched(world: World, positions: Iterable[Vector], tick_s: float = TICK_S) -> list[Touch]:
    """Return the contact along a path, tick by tick."""
    touches: list[Touch] = []
    before: Vector | None = None
    for x, y, z in positions:
        was_x, was_y, was_z = (x, y, z) if before is None else before
        velocity = ((x - was_x) / tick_s, (y - was_y) / tick_s, (z - was_z) / tick_s)
        touches.append(world.touch((x, y, z), velocity, tick_s))
        before = (x, y, z)
    return touches


def line(start: Vector, end: Vector, ticks: int = 100) -> list[Vector]:
    """Return positions from start to end, both included."""
    shares = np.linspace(0.0, 1.0, ticks + 1)[:, None]
    return [(x, y, z) for x, y, z in (np.array(start) + shares * np.subtract(end, start)).tolist()]


@given(st.sampled_from(SHAPES), poses, st.tuples(metres, metres, metres))
def test_at_rest_the_force_is_stiffness_times_depth_along_the_normal(
    shape: Shape, pose: Transform, position: Vector
) -> None:
    placed = surface(shape, pose, friction=0.5)
    distance, *direction = placed.nearest(*position)
    touch = World([placed], RADIUS).touch(position, REST, TICK_S)
    if distance >= RADIUS:
        assert touch is NO_TOUCH
    else:
        expected = np.multiply(STIFFNESS * (RADIUS - distance), direction)
        assert touch.force == pytest.approx(expected, rel=1e-12, abs=1e-9)
        assert touch.torque == (0.0, 0.0, 0.0)


@given(st.floats(-0.01, 0.01), speeds, st.floats(0.0, 100.0))
def test_damping_adds_a_share_and_never_pulls(height: float, speed: float, damping: float) -> None:
    world = World([surface(damping=damping)], RADIUS)
    normal = world.touch((0.0, 0.0, height), (0.3, 0.0, speed), TICK_S).force[2]
    depth = max(0.0, RADIUS - height)
    assert normal == pytest.approx(STIFFNESS * depth * max(0.0, 1.0 - damping * speed))
    assert normal >= 0.0


def wander(seed: int, ticks: int, size: float, middle: Vector) -> list[Vector]:
    """Return a smooth random path round a point that begins and ends there."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, ticks + 1)[:, None]
    waves = sum(rng.normal(size=3) * np.sin(pi * n * t) / n for n in range(1, 6))
    return [(x, y, z) for x, y, z in (np.array(middle) + size * np.asarray(waves)).tolist()]


@given(st.integers(0, 10**6), st.floats(0.0, 2.0), st.sampled_from(SHAPES))
def test_friction_stays_in_its_cone(seed: int, friction: float, shape: Shape) -> None:
    placed = surface(shape, at(0.0, 0.0, -0.1), friction=friction)
    for position, touch in zip(
        path := wander(seed, 200, 0.01, (0.0, 0.0, 0.0)), touched(World([placed], RADIUS), path), strict=True
    ):
        if touch is not NO_TOUCH:
            _, *direction = placed.nearest(*position)
            normal = float(np.dot(touch.force, direction))
            along = np.linalg.norm(np.subtract(touch.force, np.multiply(normal, direction)))
            assert along <= friction * normal * (1.0 + 1e-9) + 1e-9


def test_friction_makes_its_torque_at_the_contact_radius() -> None:
    world = World([surface(friction=0.3)], RADIUS)
    touch = touched(world, line((0, 0, 0.004), (0.06, 0.08, 0.004)))[-1]
    arm = (0.0, 0.0, -RADIUS)
    assert touch.torque == pytest.approx(np.cross(arm, touch.force))
    assert hypot(*touch.torque) == pytest.approx(RADIUS * 0.3 * touch.force[2])


def test_before_it_slips_friction_is_a_spring_and_turning_back_unloads_it() -> None:
    world = World([surface(friction=0.5)], RADIUS)
    held = 0.5 * 0.001  # friction times depth: the spring is as stiff as the surface
    touched(world, [(0.0, 0.0, 0.004)])
    for x in (0.2 * held, 0.9 * held, -0.4 * held, 0.0):
        assert world.touch((x, 0.0, 0.004), REST, TICK_S).force[0] == pytest.approx(-STIFFNESS * x)
    touched(world, line((0, 0, 0.004), (0.1, 0, 0.004)))
    assert world.touch((0.1 - held, 0.0, 0.004), REST, TICK_S).force[0] == pytest.approx(0.0, abs=1e-9)
    assert world.touch((0.1 - 2 * held, 0.0, 0.004), REST, TICK_S).force[0] == pytest.approx(STIFFNESS * held)


@given(st.integers(0, 10**6), st.sampled_from(SHAPES), st.floats(0.0, 5.0))
def test_standing_still_keeps_every_bit_of_the_force(seed: int, shape: Shape, damping: float) -> None:
    placed = surface(shape, at(0.4, -0.3, 0.2), friction=0.4, damping=damping)
    world = World([placed], RADIUS)
    path = wander(seed, 80, 0.01, (0.4, -0.3, 0.301))[:50]
    touched(world, [*path, path[-1]])  # less friction without speed: it may slip once more
    first = world.touch(path[-1], REST, TICK_S)
    assert all(world.touch(path[-1], REST, TICK_S) == first for _ in range(50))


def test_a_contact_after_lifting_off_begins_without_friction() -> None:
    world = World([surface(friction=0.3)], RADIUS)
    touched(world, line((0, 0, 0.004), (0.05, 0, 0.004)))
    touched(world, [(0.05, 0.0, 0.006)])
    assert world.touch((0.05, 0.0, 0.004), REST, TICK_S).force[:2] == (0.0, 0.0)


ROUND: list[Shape] = [Sphere(0.02), Cylinder(0.02, 0.1)]
PLATES: list[Shape] = [Box(0.1, 0.1, 0.001), Cylinder(0.1, 0.001)]


@given(
    st.sampled_from(PLATES),
    poses,
    st.sampled_from([0.0, RADIUS]),
    st.floats(0.001, 0.05),
    st.integers(1, 40),
)
def test_the_force_keeps_its_direction_in_and_behind_a_thin_plate(
    plate: Shape, pose: Transform, radius: float, deep: float, ticks: int
) -> None:
    """Down through the plate and up again, also in one tick from above to below."""
    world = World([surface(plate, pose)], radius)
    down = line((0.02, 0.01, 0.007), (0.02, 0.01, 0.001 - deep), ticks)
    up = z_axis(pose)
    for (_, _, z), touch in zip(
        [*down, *down[::-1]],
        touched(world, [apply(pose, point) for point in [*down, *down[::-1]]]),
        strict=True,
    ):
        expected = np.multiply(STIFFNESS * max(0.0, radius + 0.001 - z), up)
        assert touch.force == pytest.approx(expected, abs=1e-6)


def z_axis(pose: Transform) -> Vector:
    """Return the z axis of a pose, in the base."""
    return rotate(pose.rotation, (0.0, 0.0, 1.0))


@given(
    st.sampled_from(ROUND),
    poses,
    st.sampled_from([0.0, RADIUS]),
    st.floats(-0.2, 0.2),
    st.floats(0.0, 0.05),
    st.integers(200, 400),
)
def test_a_round_body_pushes_against_the_direction_of_entry_also_past_its_middle(
    body: Shape, pose: Transform, radius: float, beside: float, beyond: float, ticks: int
) -> None:
    """Nearly through the middle, and out again."""
    world = World([surface(body, pose)], radius)
    reach = 0.02 + radius
    y = beside * 0.5 * reach
    way_in = line((0.1, y, 0.0), (-beyond, y, 0.0), ticks)
    touch = touched(world, [apply(pose, point) for point in way_in])[-1]
    out = rotate(transpose(pose.rotation), touch.force)
    # From half of the path on it is pushed along its direction there.
    expected = np.array([sqrt(1.0 - beside**2), beside])
    depth = reach - float(expected @ (-beyond, y))
    off = np.subtract(out, (*(STIFFNESS * depth * expected), 0.0))
    assert np.linalg.norm(off) <= 0.03 * STIFFNESS * depth
    back = touched(world, [apply(pose, point) for point in way_in[::-1]])
    assert back[-1] is NO_TOUCH
    assert all(rotate(transpose(pose.rotation), each.force)[0] >= -1e-9 for each in back)


def test_a_moved_surface_carries_the_tcp_along_by_friction() -> None:
    world = World([surface(friction=0.5)], RADIUS)
    touched(world, [(0.0, 0.0, 0.004)])
    world.move("it", at(0.0001, 0.0, 0.0005))
    touch = world.touch((0.0, 0.0, 0.004), REST, TICK_S)
    assert touch.force == pytest.approx((STIFFNESS * 0.0001, 0.0, STIFFNESS * 0.0015))
    world.move("it", at(0.1, 0.0, 0.0))
    touch = world.touch((0.0, 0.0, 0.004), REST, TICK_S)
    assert touch.force == pytest.approx((STIFFNESS * 0.0005, 0.0, STIFFNESS * 0.001)), "it slips"
    world.move("it", at(0.0, 0.0, -0.1))
    assert world.touch((0.0, 0.0, 0.004), REST, TICK_S) is NO_TOUCH


def thrown(placed: Surface, start: Vector, velocity: Vector, weight_n: float, steps: int) -> list[float]:
    """Throw a ball of 2 kg; return its energy (J) at every step in which it touches nothing."""
    world, dt_s, mass = World([placed], RADIUS), 2e-5, 2.0
    (x, y, z), (vx, vy, vz) = start, velocity
    energies: list[float] = []
    for _ in range(steps):
        touch = world.touch((x, y, z), (vx, vy, vz), dt_s)
        if touch is NO_TOUCH:
            energies.append(0.5 * mass * (vx * vx + vy * vy + vz * vz) + weight_n * z)
        fx, fy, fz = touch.force
        vx, vy, vz = vx + dt_s * fx / mass, vy + dt_s * fy / mass, vz + dt_s * (fz - weight_n) / mass
        x, y, z = x + dt_s * vx, y + dt_s * vy, z + dt_s * vz
    return energies


@settings(max_examples=some(20), deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(
    st.sampled_from(SHAPES),
    st.floats(0.0, 1.0),
    st.floats(-0.5, 0.5),
    st.sampled_from([0.0, 0.5, 5.0]),
    st.sampled_from([2_000.0, 100_000.0]),
)
def test_a_mass_that_bounces_and_slides_gains_no_energy(
    shape: Shape, friction: float, across: float, damping: float, stiffness: float
) -> None:
    pose = at(0.0, 0.0, 0.0 if shape is SHAPES[0] else -0.1)
    placed = surface(shape, pose, friction=friction, damping=damping, stiffness=stiffness)
    energies = thrown(placed, (0.0, 0.0, 0.02), (across, 0.0, 0.0), 20.0, 8_000)
    highest = np.minimum.accumulate(energies)
    assert (np.array(energies) <= highest + 1e-3 * abs(energies[0]) + 1e-9).all()


def test_damping_of_a_bounce_agrees_with_hunt_and_crossley() -> None:
    """Their coefficient of restitution for a small loss: 1 - 2/3 b v."""
    damping, speed = 0.1, 0.5
    energies = thrown(surface(damping=damping), (0.0, 0.0, 0.006), (0.0, 0.0, -speed), 0.0, 5000)
    restitution = sqrt(energies[-1] / energies[0])
    assert 1.0 - restitution == pytest.approx(2.0 / 3.0 * damping * speed, rel=0.05)
