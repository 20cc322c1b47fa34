"""Parts in the jaws: gripped, carried, pressed on things, slipping, let go, lost, taken away."""

from __future__ import annotations

from itertools import pairwise
from math import hypot

import numpy as np
import pinocchio as pin
import pytest

from iiwa_sim.controller.carrying import ToolLoad
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from tests.requests import lin_force_move, lin_move_at, ptp_move
from tests.world.scenes import CLOSE, GRIPPER, HEAD, HOLDS, TABLE_MM, G, Scene, down, part, table

OWN = 1e7
"""Stiffness (N/m) of a nearly rigid part."""
SLOPPY = GRIPPER.replace("grip_force_n = 40", "grip_force_n = 400")


def holding(
    friction: float = 0.5,
    stiffness: float = 5e4,
    gripper: str = GRIPPER,
    size: str = "[40, 40, 60]",
    more: str = "",
) -> Scene:
    """Return a scene with a part of 0.5 kg in the jaws, 80 mm above a table of a stiffness."""
    block = part("block", (550, -100, 330), size, 0.5, friction, OWN)
    scene = Scene(block, table(stiffness), more, head=HEAD + gripper)
    scene.rests()
    scene.picks(550, -100, 330)
    scene.step(100)
    return scene


def height_with_load(scene: Scene) -> float:
    """Set the load of the held part; return the height (m) of the TCP above its middle."""
    above = scene.controller.tcp().translation[2] - scene.world.pose(0).translation[2]
    scene.controller.set_tool_load(ToolLoad(0.5, (0.0, 0.0, 0.15 - above)))
    scene.step(10)
    assert np.abs(scene.force).max() < 1e-6, "a known load has no external wrench"
    return above


def test_jaws_grip_a_part_and_inputs_report_it() -> None:
    scene = Scene(part("block", (550, -100, 330)), table())
    scene.rests()
    assert scene.part("block").state == "lies"
    scene.goes(down(550, -100, 420), straight=False)
    scene.goes(down(550, -100, 330))
    scene.controller.io.set_output(CLOSE, True)
    ticks = scene.until(lambda: scene.controller.io.input(HOLDS))
    assert ticks * 0.002 == pytest.approx((60.0 - 40.0) / 120.0, abs=0.01)
    state = scene.handling.state
    assert state is not None
    assert (state.opening_mm, state.state) == (pytest.approx(40.0, abs=1e-3), "holds")
    assert scene.part("block").state == "held"
    assert scene.events == ["the gripper holds part 'block'"]
    scene.drives(closed=False)
    assert scene.events[1:] == ["part 'block' is let go: the gripper has opened"]
    assert scene.part("block").state == "lies"
    assert scene.place_mm("block") == pytest.approx((550.0, -100.0, 330.0), abs=0.2)


@pytest.mark.parametrize("speed", [0.01, 0.25])
@pytest.mark.parametrize(("stiffness", "deepest_m"), [(5e3, 0.01), (1e5, 0.002)])
def test_a_held_part_presses_with_the_stiffness_of_the_cell(
    stiffness: float, deepest_m: float, speed: float
) -> None:
    scene = holding(stiffness=stiffness, gripper=SLOPPY)
    high_mm = 330.0 + 1e3 * height_with_load(scene)
    scene.goes(down(550, -100, high_mm + 80.0 * speed))
    k = 1.0 / (1.0 / stiffness + 1.0 / OWN)
    scene.controller.move(lin_move_at(down(550, -100, high_mm - 20.0), speed, 0.0))
    deep = before = 0.0
    while scene.controller.moving and deep < deepest_m:
        scene.step()
        before, deep = deep, 0.33 - scene.world.pose(0).translation[2]
        assert -scene.force[2] == pytest.approx(k * max(deep, 0.0), rel=1e-5, abs=1e-3)
    assert deep - before == pytest.approx(0.002 * speed, rel=0.05)


@pytest.mark.parametrize("speed", [0.005, 0.05, 0.25])
def test_a_held_part_that_is_dragged_over_a_table_has_coulomb_friction(speed: float) -> None:
    scene = holding()
    high_mm = 329.6 + 1e3 * height_with_load(scene)
    scene.goes(down(550, -100, high_mm + 1.0))
    scene.goes(down(550, -100, high_mm), 0.05)
    scene.controller.move(lin_move_at(down(550, -100 + 300 * speed, high_mm), speed, 0.0))
    scene.step(100)
    normal = 4e-4 / (1.0 / 5e4 + 1.0 / OWN)
    assert scene.force[:3] == pytest.approx((0.0, -0.5 * normal, -normal), rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("stiffness", [5e4, 1e6])
def test_a_force_move_with_a_part_ends_at_threshold_over_stiffness(stiffness: float) -> None:
    scene = holding(stiffness=stiffness)
    above = height_with_load(scene)
    scene.controller.move(lin_force_move(down(550, -100, 320), 0.02, 0.0, (None, None, 8.0)))
    scene.robot.runs_until_stopped()
    met = scene.robot.contacts[-1]
    deep = 0.33 - (1e-3 * met.tcp.z_mm - above)
    k = 1.0 / (1.0 / stiffness + 1.0 / OWN)
    tick = k * 0.02 * 0.002
    assert 8.0 < k * deep < 8.0 + 1.3 * tick


def test_a_force_move_onto_a_free_part_ends_without_damping() -> None:
    scene = holding(more=part("lower", (550, 100, 330), stiffness=5e4))
    above = height_with_load(scene)
    scene.goes(down(550, 100, 392 + 1e3 * above))
    scene.controller.move(lin_force_move(down(550, 100, 380), 0.02, 0.0, (None, None, 8.0)))
    scene.robot.runs_until_stopped()
    deep = 0.39 - (1e-3 * scene.robot.contacts[-1].tcp.z_mm - above)
    k = 1.0 / (1.0 / OWN + 1.0 / 5e4 + 2.0 / 5e4)
    assert 8.0 < k * deep < 9.0


def test_weight_and_inertia_of_a_held_part_act_on_the_robot() -> None:
    scene = holding()
    assert scene.force[2] == pytest.approx(0.5 * G, abs=1e-6)
    assert np.abs(np.array(scene.force[:2])).max() < 1e-6
    world, h = scene.world, scene.controller.tick_s
    scene.controller.move(ptp_move(Frame(450.0, 250.0, 500.0, 2.6, 0.3, 2.4), 1.0, 0.0))
    felt, middles, bodies, tcps = [], [], [], []
    while scene.controller.moving:
        scene.step()
        felt.append(scene.force)
        middles.append(np.array(world.pose(0).translation))
        bodies.append(np.array(world.pose(0).rotation).reshape(3, 3))
        tcps.append(scene.controller.tcp())
    inertia = 0.5 / 12.0 * np.diag([0.04**2 + 0.06**2, 0.04**2 + 0.06**2, 2.0 * 0.04**2])
    spins = [pin.log3(b @ a.T) / h for a, b in pairwise(bodies)]
    expected = []
    for k in range(1, len(felt) - 1):
        force = 0.5 * ((middles[k + 1] - 2.0 * middles[k] + middles[k - 1]) / h**2 + (0.0, 0.0, G))
        seen, spin = bodies[k] @ inertia @ bodies[k].T, 0.5 * (spins[k - 1] + spins[k])
        moment = seen @ (spins[k] - spins[k - 1]) / h + np.cross(spin, seen @ spin)
        moment += np.cross(middles[k] - tcps[k].translation, force)
        turn = np.array(tcps[k].rotation).reshape(3, 3)
        expected.append(-np.concatenate([force @ turn, moment @ turn]))
    off = np.abs(np.array(felt[1:-1]) - expected)
    greatest = np.abs(expected)
    assert greatest[:, :3].max() > 1.1 * 0.5 * G
    assert off[:, :3].max() < 1e-6 * greatest[:, :3].max()
    assert off[:, 3:].max() < 1e-3 * greatest[:, 3:].max()


def test_a_part_keeps_its_place_in_the_jaws_and_is_put_down() -> None:
    scene = holding()
    before = scene.world.pose(0).translation[2] - scene.controller.tcp().translation[2]
    for frame in (down(450, 200, 500), down(600, -200, 450), down(550, 100, 420)):
        scene.goes(frame, 1.0, straight=False)
    after = scene.world.pose(0).translation[2] - scene.controller.tcp().translation[2]
    assert after == pytest.approx(before, abs=1e-6)
    scene.goes(down(550, 100, 331))
    scene.drives(closed=False)
    assert scene.place_mm("block") == pytest.approx((550.0, 100.0, 330.0), abs=0.3)


def test_a_part_that_is_let_go_in_motion_keeps_its_velocity() -> None:
    scene = holding()
    scene.controller.move(lin_move_at(down(550, 200, 410), 0.1, 0.0))
    scene.step(450)
    scene.controller.io.set_output(CLOSE, False)
    scene.step()
    assert scene.part("block").state == "falls"
    assert scene.speeds[0, :2] == pytest.approx((0.0, 0.09), abs=5e-3)


def test_a_light_part_rides_on_a_held_one() -> None:
    scene = holding(more=part("rider", (450, 300, 305), "[20, 20, 10]", 0.05))
    world, (x, y, z) = scene.world, scene.world.pose(0).translation
    world.catch_up(now=True)
    world.part_q[1], world.part_v[1] = (x, y, z + 0.035, 1.0, 0.0, 0.0, 0.0), 0.0
    world.wake()
    scene.goes(down(550, 100, 450), 0.2)
    scene.step(200)
    rides = scene.place_mm("rider") - scene.place_mm("block")
    assert rides == pytest.approx((0.0, 0.0, 35.0), abs=0.1)
    assert scene.force[2] == pytest.approx(0.55 * G, rel=1e-3)


@pytest.mark.parametrize(("stiffness", "speed"), [(5e3, 0.1), (5e4, 0.25)])
def test_a_part_slips_beyond_twice_its_friction(stiffness: float, speed: float) -> None:
    scene = holding(stiffness=stiffness)
    above = height_with_load(scene)
    deep_mm = 12.0 if stiffness == 5e3 else 3.0
    limit = 2.0 * 0.5 * 40.0
    scene.controller.move(lin_move_at(down(550, -100, 330 - deep_mm + 1e3 * above), speed, 0.0))
    slipping = []
    while scene.controller.moving:
        scene.step()
        if hypot(*scene.arm.slip) > 0.0:
            x, _, z = scene.arm.wrench[:3]
            slipping.append(hypot(x, z))
    assert max(slipping) == pytest.approx(limit, rel=0.03)
    scene.step(100)
    assert scene.part("block").state == "held"
    assert scene.place_mm("block")[2] > scene.controller.tool_frame().z_mm + 1.0 - 1e3 * above


def test_a_lost_part_falls_and_the_jaws_close() -> None:
    scene = holding()
    scene.handling.lose()
    scene.step(2)
    assert scene.part("block").state == "falls"
    scene.rests()
    state = scene.handling.state
    assert state is not None
    assert state.state == "closed"
    assert not scene.controller.io.input(HOLDS)
    assert scene.force == (0.0,) * 6
    assert scene.events[-1] == "part 'block' falls out of the gripper: made to through the backdoor"
    with pytest.raises(Refused, match="the gripper holds no part"):
        scene.handling.lose()


def test_a_part_that_is_lost_where_it_stands_is_gripped_again() -> None:
    scene = Scene(part("block", (550, -100, 330)), table())
    scene.rests()
    scene.picks(550, -100, 330, up_mm=0)
    scene.rests()
    scene.handling.lose()
    scene.rests()
    for closed in (False, True):
        scene.drives(closed=closed)
    assert scene.part("block").state == "held"


def test_a_cup_holds_a_part_up_to_its_force() -> None:
    wired = "close_output = 1\nholds_input = 3\nclosed_input = 2\n"
    cup = f'[gripper]\nkind = "suction"\ngrip_force_n = 10\n{wired}'
    scene = Scene(
        part("block", (550, -100, 330)), part("heavy", (550, 100, 330), kg=1.5), table(), head=HEAD + cup
    )
    state = scene.handling.state
    assert state is not None
    assert state.state == "open"
    for y, held in ((-100.0, True), (100.0, False)):
        scene.goes(down(550, y, 420), straight=False)
        scene.controller.io.set_output(CLOSE, True)
        scene.step(5)
        assert scene.controller.io.input(2)
        scene.goes(down(550, y, 359.5), 0.1)
        scene.step(50)
        assert scene.controller.io.input(HOLDS)
        scene.goes(down(550, y, 420), 0.1)
        assert scene.controller.io.input(HOLDS) == held
        scene.controller.io.set_output(CLOSE, False)
        scene.rests()
    assert "part 'heavy' has slipped out of the gripper" in scene.events
    assert scene.place_mm("block")[2] == pytest.approx(TABLE_MM + 30.0, abs=0.5)
