"""How deep what presses on a part is in it, along the line of a capsule and at a place of what is held."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.crowd import PressingBall
from iiwa_sim.contact.shapes import Box, Shape
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import NOT_IN
from iiwa_sim.contact.world_kernel import World
from iiwa_sim.frames import Vector, transform_from_euler
from tests.contact.floor import SHAPES, TICK_S, Floor
from tests.samples import some

STIFFNESS = 3e4
COUNT = 400
NEAR_M = 1e-3
"""Within this of a part its depth is looked for all along a line."""
HELD = Surface(
    "held", Box(0.01, 0.01, 0.01), transform_from_euler(0.5, 0.5, 0.5, 0.0, 0.0, 0.0), 1e4, 0.0, 0.0
)
"""Far from all parts: only the places that are said press on them."""
shapes, angles = st.sampled_from(SHAPES), st.floats(-3.1, 3.1)
place = st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(0.0, 0.06))
step = st.floats(-2e-3, 2e-3)
ways = st.lists(st.tuples(step, step, step), min_size=2, max_size=20)


@settings(max_examples=some(200), deadline=None)
@given(shape=shapes, angle=angles, start=place, end=place, radius=st.floats(0.001, 0.01))
def test_a_capsule_is_as_deep_in_a_part_as_the_deepest_ball_along_its_line(
    shape: Shape, angle: float, start: Vector, end: Vector, radius: float
) -> None:
    floor = Floor()
    floor.put(shape, 0.0, 0.0, angle)
    floor.begin()
    floor.crowd.hold(-1, None)
    along = np.array(start) + np.linspace(0.0, 1.0, COUNT)[:, None] * np.subtract(end, start)
    depths = [floor.crowd.look(0, [PressingBall((x, y, z), radius, STIFFNESS)]) for x, y, z in along.tolist()]
    deepest = int(np.argmax(depths))
    assume(depths[deepest] > 1e-4 - NEAR_M)
    x, y, z = along[deepest].tolist()
    dx, dy, dz = np.subtract(end, start).tolist()
    given = PressingBall((x, y, z), radius, STIFFNESS, start=start, line=(dx, dy, dz))
    between = float(np.linalg.norm(np.subtract(end, start))) / COUNT
    assert depths[deepest] - 1e-7 <= floor.crowd.look(0, [given]) <= depths[deepest] + between


@settings(max_examples=some(300), deadline=None)
@given(
    shape=shapes,
    turn=st.tuples(angles, st.floats(-4.0, 4.0)),
    at=place,
    ways=ways,
    radius=st.sampled_from([0.0, 0.004, 0.02]),
    friction=st.floats(0.0, 1.0),
)
def test_what_a_crowd_has_a_held_place_feel_its_contact_feels_too(
    shape: Shape,
    turn: tuple[float, float],
    at: Vector,
    ways: list[Vector],
    radius: float,
    friction: float,
) -> None:
    """When the part has gone its way. So what the arm gives is what the part gets, to rounding."""
    floor = Floor()
    floor.put(shape, 0.0, 0.0, turn[0], (0.0, 0.0, 0.0, turn[1]))
    floor.begin()
    world = World([floor.laid[0].solid._replace(stiffness=STIFFNESS, friction=friction)], radius)
    for way in ways:
        at = (at[0] + way[0], at[1] + way[1], at[2] + way[2])
        rotation = transform_from_euler(0.0, 0.0, 0.0, *(30.0 * each for each in at)).rotation
        contact, rubbed = world.at("part", at)
        by = world.turned(rotation)
        rubs = (0.0 if rubbed is None else friction), STIFFNESS, rubbed or (0.0, 0.0, 0.0)
        floor.step(
            (0, PressingBall(at, radius, STIFFNESS, *rubs, NOT_IN, 1, contact=contact, turned=by)),
            held=HELD,
        )
        world.move("part", floor.laid[0].solid.pose)
        for unpressed_m in floor.crowd.unpressed.values():
            world.leave("part", unpressed_m)
        world.roll(rotation)
        force, torque = world.feel(at, (0.0, 0.0, 0.0), TICK_S)
        lever = np.subtract(at, HELD.pose.translation)
        felt = [*force, *(np.array(torque) + np.cross(lever, force))]
        found = floor.crowd.on_held.get(0, np.zeros(6))
        assert found.tolist() == pytest.approx(felt, rel=1e-6, abs=1e-7)
