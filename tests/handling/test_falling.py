"""How parts fall and come to rest: against a fine integration of the same laws, and energy."""

from __future__ import annotations

from math import hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Frame, Transform, Vector
from iiwa_sim.handling.falling import FALLS, GONE, LIES, STILL, Body, moved, sag
from iiwa_sim.handling.ground import Ground, ground_of, grounds_of
from iiwa_sim.handling.part import Part
from tests.handling.scenes import BALL, BLOCK, PIN, TABLE, TABLE_MM, at
from tests.samples import some

G = 9.81
TICK_S = 0.002
GROUND = grounds_of([TABLE])
FLOOR = Surface("floor", Plane(), Frame(0, 0, 0, 0, 0, 0).to_transform(), 5e4, 0.0, 0.3)


def falls(body: Body, grounds: list[Ground], tick_s: float = TICK_S, limit_s: float = 60.0) -> list[Body]:
    """Tick by tick, until it rests."""
    found = [body]
    while not found[-1].settled:
        found.append(moved(found[-1], grounds, tick_s))
        assert len(found) * tick_s < limit_s, "it never rests"
    return found


def energy(body: Body, grounds: list[Ground]) -> float:
    """Of height, of motion, and of what presses on the ground (J)."""
    part, (_, _, z) = body.part, body.pose.translation
    there = [each for each in grounds if each.name == body.on]
    pressed = sum(0.5 * each.stiffness_below(part) * max(0.0, each.top - body.bottom) ** 2 for each in there)
    return part.mass_kg * G * z + 0.5 * part.mass_kg * sum(v * v for v in body.velocity) + pressed


def finely(part: Part, place: Vector, velocity: Vector, half_m: float, ground: Ground) -> Vector:
    """Where the middle comes to rest, by steps of 10 us: a spring that is damped so much that nothing
    bounces, and friction that is never more than its coefficient times the force of the ground."""
    k, m, mu = ground.stiffness_below(part), part.mass_kg, part.friction
    c, dt = 4.0 * (k * m) ** 0.5, 1e-5
    (x, y, z), (vx, vy, vz) = place, velocity
    touched = False
    for _ in range(1_000_000):
        depth = ground.top - (z - half_m)
        n = max(0.0, k * depth - c * vz) if depth > 0.0 else 0.0
        touched = touched or n > 0.0
        speed = hypot(vx, vy)
        if speed > 0.0:
            share = 1.0 - min(mu * n / m * dt, speed) / speed
            vx, vy = share * vx, share * vy
        vz += (n / m - G) * dt
        x, y, z = x + vx * dt, y + vy * dt, z + vz * dt
        if touched and speed == 0.0 and abs(vz) < 1e-6 and depth > 0.0:
            break
    return x, y, z


@pytest.mark.parametrize(
    ("height_m", "velocity"),
    [(0.001, (0.0, 0.0, 0.0)), (0.05, (0.2, 0.1, 0.0)), (0.1, (0.4, -0.3, 0.5)), (0.02, (0.8, 0.0, -0.5))],
)
@pytest.mark.parametrize("part", [BLOCK._replace(friction=0.2), BLOCK], ids=["smooth", "rough"])
def test_it_rests_within_a_millimetre_of_a_fine_integration(
    part: Part, height_m: float, velocity: tuple[float, float, float]
) -> None:
    start = Body(part, at(500.0, 0.0, TABLE_MM + 30.0 + 1e3 * height_m), velocity, FALLS)
    rests = falls(start, GROUND)[-1]
    expected = finely(part, start.pose.translation, velocity, 0.03, GROUND[0])
    assert rests.state == LIES
    assert rests.pose.translation == pytest.approx(expected, abs=1e-3)


def test_in_the_air_it_is_on_a_parabola() -> None:
    start = Body(BALL, at(0.0, 0.0, 2000.0), (0.3, -0.2, 1.0), FALLS)
    for tick, body in enumerate(falls(start, grounds_of([FLOOR]))):
        if body.state != FALLS:
            assert tick > 100
            break
        t = tick * TICK_S
        assert body.pose.translation == pytest.approx(
            (0.3 * t, -0.2 * t, 2.0 + t - 0.5 * G * t * t), abs=1e-9
        )


def test_where_it_rests_does_not_depend_on_the_tick() -> None:
    start = Body(BLOCK._replace(friction=0.3), at(450.0, 0.0, 400.0, 0.3), (0.5, 0.4, 0.2), FALLS)
    ends = [falls(start, GROUND, tick_s)[-1].pose.translation for tick_s in (0.001, 0.002, 0.01)]
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
    assert ends[2] == pytest.approx(ends[0], abs=1e-9)


def test_over_the_edge_it_falls_to_the_floor_and_beside_all_it_is_gone() -> None:
    grounds = grounds_of([TABLE, FLOOR])
    start = Body(BLOCK._replace(friction=0.1), at(900.0, 0.0, TABLE_MM + 40.0), (1.0, 0.0, 0.0), FALLS)
    path = falls(start, grounds)
    assert next(each.on for each in path if each.on) == "table"
    assert path[-1].on == "floor"
    assert path[-1].pose.translation[0] > 1.0
    assert falls(start, GROUND)[-1].state == GONE
    sliding = Body(BALL._replace(friction=0.0), at(0.0, 0.0, 20.0), (3.0, 0.0, 0.0), FALLS)
    assert falls(sliding, grounds_of([FLOOR]))[-1].state == GONE  # without friction, to the end of the world


def test_it_lies_pressed_in_by_its_weight() -> None:
    start = Body(PIN, at(600.0, 0.0, TABLE_MM + 30.5), STILL, FALLS)
    rests = falls(start, GROUND)[-1]
    depth = 0.3 * G / (1.0 / (1.0 / 2e4 + 1.0 / 5e4))
    assert rests.pose.translation == pytest.approx((0.6, 0.0, 1e-3 * TABLE_MM + 0.03 - depth))
    assert sag(PIN, GROUND[0]) == pytest.approx(depth)


def test_tilted_it_is_laid_on_the_nearest_face() -> None:
    pose = Frame(600.0, 0.0, 400.0, 0.5, 0.4, 0.2).to_transform()
    rests = falls(Body(BLOCK, pose, STILL, FALLS), GROUND)[-1]
    assert BLOCK.is_level(rests.pose.rotation)
    assert rests.pose.rotation[8] == pytest.approx(1.0)
    fell_over = Frame(600.0, 0.0, 400.0, 0.5, 1.2, 0.2).to_transform()
    rests = falls(Body(BLOCK, fell_over, STILL, FALLS), GROUND)[-1]
    assert abs(rests.pose.rotation[8]) < 1e-9


@pytest.mark.parametrize(
    ("shape", "pose", "top", "inside", "outside"),
    [
        (Plane(), at(0, 0, 100), 0.1, (5.0, 5.0), None),
        (Plane(), Frame(0, 0, 0, 0, 0.01, 0).to_transform(), None, None, None),
        (Box(0.1, 0.2, 0.3), at(0, 0, 0, 0.5), 0.3, (0.08, 0.0), (0.0, 0.25)),
        (
            Box(0.1, 0.2, 0.3),
            Frame(0, 0, 0, 0, 1.5707963267948966, 0).to_transform(),
            0.1,
            (0.25, 0.15),
            (0.0, 0.25),
        ),
        (Box(0.1, 0.2, 0.3), Frame(0, 0, 0, 0, 0.7, 0).to_transform(), None, None, None),
        (Cylinder(0.1, 0.2), at(0, 0, 0), 0.2, (0.05, 0.08), (0.08, 0.08)),
        (Cylinder(0.1, 0.2), Frame(0, 0, 0, 0, 1.5707963267948966, 0).to_transform(), None, None, None),
        (Sphere(0.1), IDENTITY, None, None, None),
    ],
)
def test_level_faces(
    shape: Box | Cylinder | Sphere | Plane,
    pose: Transform,
    top: float | None,
    inside: tuple[float, float] | None,
    outside: tuple[float, float] | None,
) -> None:
    ground = ground_of("it", shape, pose, 1e4)
    if top is None or inside is None:
        assert ground is None
        return
    assert ground is not None
    assert ground.top == pytest.approx(top)
    assert ground.has(*inside)
    assert outside is None or not ground.has(*outside)


place = st.floats(-0.3, 0.3)
speed = st.floats(-1.5, 1.5)
angle = st.floats(-3.1, 3.1)


@settings(max_examples=some(60))
@given(
    part=st.sampled_from([BLOCK, PIN, BALL, BLOCK._replace(shape=Box(0.05, 0.01, 0.1), friction=0.05)]),
    where=st.tuples(place, place, st.floats(0.0, 0.4)),
    turned=st.tuples(angle, angle, angle),
    velocity=st.tuples(speed, speed, speed),
)
def test_no_fall_gains_energy(
    part: Part,
    where: tuple[float, float, float],
    turned: tuple[float, float, float],
    velocity: tuple[float, float, float],
) -> None:
    """Against the least there has been, not against the tick before."""
    x, y, z = where
    rotation = Frame(0, 0, 0, *turned).to_transform().rotation
    height = 1e-3 * TABLE_MM + part.reach(rotation, 2) + z
    grounds = grounds_of([TABLE, FLOOR])
    least = None
    for body in falls(Body(part, Transform(rotation, (0.6 + x, y, height)), velocity, FALLS), grounds):
        now = energy(body, grounds)
        least = now if least is None else least
        assert now <= least + 1e-9
        least = min(now, least)
