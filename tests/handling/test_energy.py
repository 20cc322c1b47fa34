"""Grip and release at rest, and what follows: no scene gains energy."""

from __future__ import annotations

from hypothesis import example, given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box
from iiwa_sim.frames import IDENTITY, Frame, Transform, rotate
from iiwa_sim.handling.falling import FALLS, STILL, Body, landed
from iiwa_sim.handling.gripper import CLOSES, Gripper, Jaws
from iiwa_sim.handling.ground import grounds_of
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.workpieces import Workpieces
from tests.grip_hunting import ROUNDING_J, SHAPES, GripScene
from tests.handling.scenes import DOWN, TABLE
from tests.samples import some

TICK_S = 0.002

part = st.builds(
    lambda shape, mass, friction, stiffness: Part("it", shape, mass, friction, stiffness),
    st.sampled_from(SHAPES),
    st.floats(0.05, 2.0),
    st.floats(0.0, 1.0),
    st.floats(2e4, 5e5),
)


@settings(max_examples=some(150), deadline=None)
@given(st.integers(0, 10**6))
@example(98)  # falls, is caught, and slides into the table
def test_gripping_holding_slipping_and_letting_go_gain_none(seed: int) -> None:
    """With the TCP at rest, against the least there has been: above a hard table as above none."""
    assert GripScene(seed).run() <= ROUNDING_J


@settings(max_examples=some(100))
@given(
    part=part,
    velocity=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)),
    force=st.floats(0.5, 100.0),
    ticks=st.integers(1, 60),
)
@example(
    part=Part("it", Box(0.02, 0.02, 0.03), 0.25, 0.0, 20_000.0), velocity=(0.25, 0.0), force=1.0, ticks=4
)
def test_jaws_that_close_on_a_part_in_motion_bring_it_along_by_their_work(
    part: Part, velocity: tuple[float, float], force: float, ticks: int
) -> None:
    """What moves the TCP on evenly does as much work on the flange as the part gains, or more."""
    height_m = part.reach(IDENTITY.rotation, 2)
    top = grounds_of([TABLE])[0]
    lying = landed(Body(part, Transform(IDENTITY.rotation, (0.6, 0.0, 0.3 + height_m)), STILL, FALLS), top)
    surfaces = [TABLE._replace(stiffness=1e9)]  # else it is felt to be a little lighter while it is pressed
    gripper = Gripper(Jaws(0.1, 0.4, force, 0.03, 0.03))
    pieces = Workpieces([lying], surfaces, gripper, TICK_S)
    vx, vy = velocity
    at = [0.6 - 0.05 * vx, -0.05 * vy, 0.3 + height_m]
    work_j, seen = 0.0, 0
    while seen < ticks and abs(at[0] - 0.6) < 0.2 and abs(at[1]) < 0.2:
        at[0] += vx * TICK_S
        at[1] += vy * TICK_S
        tcp = Transform(Frame(0, 0, 0, *DOWN).to_transform().rotation, (at[0], at[1], at[2]))
        was_m = gripper.opening_m
        gripper.step(CLOSES, pieces.width_m, TICK_S)
        if not pieces.held and gripper.opening_m < was_m:
            width_m = pieces.grip(tcp, was_m)
            if width_m > 0.0:
                gripper.block(width_m)
        going = Transform(tcp.rotation, (at[0] + vx * TICK_S, at[1] + vy * TICK_S, at[2]))
        pieces.step(tcp, going)
        fx, fy, _ = rotate(tcp.rotation, pieces.wrench[:3])
        work_j -= (fx * vx + fy * vy) * TICK_S
        body = pieces.bodies["it"]
        if pieces.held:
            seen += 1
            assert pieces._held is not None
            moves = pieces._held.velocity
            assert 0.5 * part.mass_kg * (moves[0] ** 2 + moves[1] ** 2) <= work_j * (1.0 + 1e-6) + 1e-9
        elif was_m == 0.0 or body.state == FALLS:
            return
