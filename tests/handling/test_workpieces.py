"""Parts between the jaws of a robot: picked, carried, put down, lost."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot

import numpy as np
import pinocchio as pin
import pytest

from iiwa_sim.backdoor.states import States
from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.carrying import ToolLoad
from iiwa_sim.controller.handling import Handling
from iiwa_sim.frames import Frame, compose, inverse
from iiwa_sim.handling.falling import FALLS, GONE, HELD, LIES
from iiwa_sim.handling.part import Part
from tests.asked import joint_move, lin_force_move, lin_move
from tests.handling.scenes import BALL, BLOCK, HOLDS, JAWS, PIN, TABLE, TABLE_MM, Scene, at, down
from tests.samples import some

G = 9.81
TICK_S = 0.002
TOP = TABLE_MM + 30.0  # of the middle of block and pin


def holding(part: Part = BLOCK, **more: object) -> Scene:
    """It, lifted off the table."""
    scene = Scene((part, at(600, 50, TOP if part is not BALL else TABLE_MM + 20)), **more)  # type: ignore[arg-type]
    scene.picks(600, 50, TABLE_MM + 12.0 if part is BALL else TOP + 10.0)
    scene.goes(down(600, 50, 500))
    scene.rests()
    assert scene.body(part.name).state == HELD
    return scene


@pytest.mark.parametrize("part", [BLOCK, PIN, BALL], ids=lambda part: part.name)
def test_it_is_picked_carried_and_put_down(part: Part) -> None:
    scene = holding(part)
    assert scene.controller.io.inputs[:3] == (False, False, True)
    assert scene.handling.state.state == "holds"
    # What weighs, pulls down: along z of a TCP that points there.
    weight = part.mass_kg * G
    assert scene.controller.cartesian_force()[:3] == pytest.approx((0.0, 0.0, weight), abs=1e-6)
    before = scene.body(part.name).pose
    scene.goes(down(500, -200, 500))
    moved = scene.body(part.name).pose
    assert np.subtract(moved.translation, before.translation) == pytest.approx((-0.1, -0.25, 0.0), abs=1e-9)
    lower_mm = 1e3 * (moved.translation[2] - part.reach(moved.rotation, 2)) - TABLE_MM
    scene.goes(down(500, -200, 500 - lower_mm), 0.2)
    scene.closes(closed=False)
    scene.rests()
    body = scene.body(part.name)
    assert (body.state, body.on) == (LIES, "table")
    assert body.pose.translation[:2] == pytest.approx((0.5, -0.2), abs=1e-6)
    assert scene.controller.cartesian_force() == (0.0,) * 6
    assert scene.controller.io.inputs[:3] == (True, False, False)


def test_on_the_table_the_table_carries_it() -> None:
    """So closing the jaws on it pulls nothing, and lifting it loads the flange little by little."""
    scene = Scene((BLOCK, at(600, 50, TOP)))
    scene.picks(600, 50, TOP)
    scene.rests()
    assert scene.body("block").state == HELD
    assert scene.controller.cartesian_force() == pytest.approx((0.0,) * 6, abs=1e-4)  # `INSET_M` of a spring
    half_mm = 0.5 * 1e3 * BLOCK.mass_kg * G / (1.0 / (1.0 / 2e4 + 1.0 / 5e4))
    scene.goes(down(600, 50, TOP + half_mm))
    scene.rests()
    assert scene.controller.cartesian_force()[2] == pytest.approx(0.5 * BLOCK.mass_kg * G, abs=1e-4)


def test_a_force_move_puts_it_down() -> None:
    scene = holding()
    target = down(600, 50, 250)
    scene.controller.move(lin_force_move(target, 0.05, 0.0, (1e3, 1e3, 12.0)))
    scene.robot.runs_until_stopped()
    (contact,) = scene.robot.contacts
    assert "12 N" in str(contact)
    assert scene.body("block").bottom == pytest.approx(1e-3 * TABLE_MM, abs=6e-3)
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("block").on == "table"


def test_it_is_put_into_a_fixture_until_it_is_felt() -> None:
    """A pocket with 2 mm of room on each side, 20 mm deep; beside it the part stands on the rim."""
    height = TABLE_MM + 10.0
    walls = tuple(
        Surface(f"wall {n}", Box(*half), at(500.0 + x, -150.0 + y, height), 5e4, 0.0, 0.3)
        for n, (half, x, y) in enumerate(
            [
                ((0.01, 0.06, 0.01), 32.0, 0.0),
                ((0.01, 0.06, 0.01), -32.0, 0.0),
                ((0.022, 0.01, 0.01), 0.0, 32.0),
                ((0.022, 0.01, 0.01), 0.0, -32.0),
            ]
        )
    )
    for off_mm, bottom_mm in ((0.0, TABLE_MM), (5.0, TABLE_MM + 20.0)):
        scene = holding(surfaces=(TABLE, *walls))
        scene.goes(down(500.0 + off_mm, -150, 500), straight=False)
        scene.controller.move(lin_force_move(down(500 + off_mm, -150, 300), 0.02, 0.0, (1e3, 1e3, 12.0)))
        scene.robot.runs_until_stopped()
        assert len(scene.robot.contacts) == 1
        assert 1e3 * scene.body("block").bottom == pytest.approx(bottom_mm, abs=4.0)
        scene.closes(closed=False)
        scene.rests()
        if off_mm == 0.0:
            assert scene.body("block").on == "table"


def test_jaws_push_a_part_that_is_beside_the_middle_between_them() -> None:
    scene = Scene((BLOCK, at(600, 50, TOP)))
    scene.goes(down(600, 62, TOP + 80), straight=False)
    scene.goes(down(600, 62, TOP))
    scene.closes()
    scene.rests()
    assert scene.body("block").state == HELD
    assert scene.body("block").pose.translation == pytest.approx(
        (0.6, 0.062, 1e-3 * TOP - 0.00034335), abs=1e-6
    )


@pytest.mark.parametrize(
    ("x_mm", "y_mm", "z_mm"),
    [(640.0, 50.0, TOP), (600.0, 50.0, TOP + 55.0)],
    ids=["in front", "above"],
)
def test_beside_a_part_the_jaws_close_on_nothing(x_mm: float, y_mm: float, z_mm: float) -> None:
    scene = Scene((BLOCK, at(600, 50, TOP)))
    scene.picks(x_mm, y_mm, z_mm)
    scene.rests()
    assert scene.handling.state.state == "closed"
    assert scene.body("block").state == LIES
    assert scene.body("block").pose.translation[:2] == (0.6, 0.05)


def test_its_weight_and_moment_at_1000_poses() -> None:
    scene = holding(PIN)
    scene.controller.load.world.remove("table")
    controller, d = scene.controller, scene.robot.description
    tcp = controller.tcp()
    centre = compose(inverse(tcp), scene.body("pin").pose).translation
    rng = np.random.default_rng(5)
    for q in rng.uniform(d.position_min, d.position_max, (some(1000), len(d.joints))).tolist():
        controller.injected.place(q)
        for _ in range(2):
            turn = np.array(controller.tcp().rotation).reshape(3, 3)
            weight = turn.T @ (0.0, 0.0, -PIN.mass_kg * G)
            expected = np.concatenate([weight, np.cross(centre, weight)])
            assert np.abs(controller.cartesian_force() - expected).max() <= 1e-6
            jacobian = scene.robot.model.tcp(controller.tool_in_flange).jacobian(q)
            torques = jacobian.T @ np.concatenate([turn @ expected[:3], turn @ expected[3:]])
            if controller.load.itself.colliding is None:
                assert np.abs(controller.joint_torque() - torques).max() <= 1e-6
            controller.step()


def test_along_random_moves_it_is_what_newton_and_euler_say() -> None:
    """To 1 % of the greatest wrench, in the same tick. The grip is firm."""
    scene = holding(BLOCK, jaws=JAWS._replace(force_n=1000.0))
    controller, d = scene.controller, scene.robot.description
    controller.load.world.remove("table")
    model = pin.buildModelFromXML(d.urdf)
    for inertia in model.inertias:
        inertia.setZero()
    flange = model.frames[model.getFrameId(d.flange)]
    rotation, place = controller.tool_in_flange
    tcp = flange.placement * pin.SE3(np.array(rotation).reshape(3, 3), np.array(place))
    turned, centre = compose(inverse(controller.tcp()), scene.body("block").pose)
    edges = 2.0 * np.array(BLOCK.shape)
    body = pin.Inertia.FromBox(BLOCK.mass_kg, *edges)
    model.appendBodyToJoint(
        flange.parentJoint, body, tcp * pin.SE3(np.array(turned).reshape(3, 3), np.array(centre))
    )
    data, rng = model.createData(), np.random.default_rng(6)
    scene.robot.joints, felt = [controller.joints], [controller.cartesian_force()]
    for _ in range(some(10)):
        target = rng.uniform(d.position_min, d.position_max).tolist()
        controller.move(joint_move(target, rng.uniform(0.2, 1.0, len(target)).tolist()))
        while controller.moving:
            scene.robot.step()
            felt.append(controller.cartesian_force())
    q = np.array(scene.robot.joints)
    v, a = (q[2:] - q[:-2]) / (2 * TICK_S), (q[2:] - 2 * q[1:-1] + q[:-2]) / TICK_S**2
    expected = []
    for each in zip(q[1:-1], v, a, strict=True):
        pin.rnea(model, data, *each)
        expected.append(tcp.inverse().act(-data.f[flange.parentJoint]).vector)
    off = np.abs(np.array(felt[1:-1]) - expected)
    for part in (slice(0, 3), slice(3, 6)):
        assert off[:, part].max() <= 0.01 * np.linalg.norm(np.array(expected)[:, part], axis=1).max()
    assert scene.body("block").state == HELD


def test_with_the_right_tool_load_a_part_is_not_felt() -> None:
    scene = holding()
    x, y, z = compose(inverse(scene.robot.model.flange(scene.controller.joints)), scene.body("block").pose)[1]
    scene.controller.set_tool_load(ToolLoad(BLOCK.mass_kg, (x, y, z)))
    assert scene.controller.cartesian_force() == pytest.approx((0.0,) * 6, abs=1e-9)
    assert scene.controller.joint_torque() == pytest.approx((0.0,) * 7, abs=1e-9)


def test_it_slips_within_a_tick_of_where_friction_ends() -> None:
    """Sideways, along x of the TCP: what holds against that and the weight is friction on both sides."""
    part = BLOCK._replace(friction=0.2)
    scene = holding(part, jaws=JAWS._replace(force_n=100.0))
    gripper = scene.handling.gripper
    gripper.jaws = gripper.jaws._replace(force_n=12.6)
    most = 2.0 * 0.2 * 12.6  # N, for a weight of 4.9 N
    scene.controller.move(lin_move(down(400, 50, 500), 1.0, 0.0))
    tcps = [scene.controller.tcp()]
    first = compose(inverse(tcps[0]), scene.body("block").pose).translation
    too_much, slips = [False], [False]
    for _ in range(120):
        scene.robot.step()
        tcps.append(scene.controller.tcp())
        there = compose(inverse(tcps[-1]), scene.body("block").pose).translation
        slips.append(there != pytest.approx(first, abs=1e-10))
        after, now, before = (np.array(each.translation) for each in [*tcps[:1] * 2, *tcps][:-4:-1])
        pull = part.mass_kg * ((after - 2 * now + before) / TICK_S**2 + (0.0, 0.0, G))
        x, _, z = np.array(tcps[-1].rotation).reshape(3, 3).T @ pull
        too_much.append(hypot(x, z) > most)
    assert any(slips)
    assert abs(too_much.index(True) - slips.index(True)) <= 1


def test_what_is_too_heavy_for_the_grip_slips_out_and_falls() -> None:
    scene = Scene((BLOCK, at(600, 50, TOP)), jaws=JAWS._replace(force_n=4.0))  # 4 N for 4.9 N
    scene.picks(600, 50, TOP)
    assert scene.handling.state.state == "holds"
    scene.goes(down(600, 50, 500))
    scene.rests()
    assert scene.body("block").state == LIES
    assert scene.body("block").on == "table"
    assert scene.handling.state.state == "closed"
    assert scene.controller.io.inputs[:3] == (False, True, False)
    assert scene.controller.cartesian_force() == (0.0,) * 6


def test_a_part_lands_on_another_and_falls_when_that_is_taken_away() -> None:
    scene = holding()
    workpieces = scene.handling.workpieces
    assert workpieces is not None
    scene = Scene((BLOCK, at(600, 50, TOP)), (PIN, at(600, 50, TOP + 60.0)))
    assert scene.body("pin").on == "block"
    scene.handling.remove("block")
    assert scene.body("pin").state == FALLS
    scene.rests()
    assert scene.body("pin").on == "table"
    assert scene.body("block").state == GONE


def test_a_part_is_put_onto_another() -> None:
    scene = Scene((BLOCK, at(600, 50, TOP)), (PIN, at(500, -100, TOP)))
    scene.picks(500, -100, TOP)
    scene.goes(down(500, -100, TOP + 100))
    scene.goes(down(600, 50, TOP + 100))
    scene.controller.move(lin_force_move(down(600, 50, TOP), 0.05, 0.0, (1e3, 1e3, 12.0)))
    scene.robot.runs_until_stopped()
    assert len(scene.robot.contacts) == 1
    assert 1e3 * scene.controller.tcp().translation[2] == pytest.approx(TOP + 60.0, abs=6.0)
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("pin").on == "block"


def test_what_loses_its_ground_falls_to_the_next() -> None:
    shelf = TABLE._replace(name="shelf", pose=at(600.0, 0.0, 500.0))
    scene = Scene((BLOCK, at(600, 50, 550)), surfaces=(TABLE, shelf))
    assert scene.body("block").on == "shelf"
    scene.controller.load.world.remove("shelf")
    scene.rests()
    assert scene.body("block").on == "table"


def test_a_part_that_is_lost_in_mid_air_flies_on() -> None:
    scene = holding()
    scene.controller.move(lin_move(down(600, -250, 500), 1.0, 0.0))
    scene.robot.step(150)
    scene.handling.lose()
    speed = scene.body("block").velocity
    assert speed[1] < -0.1
    scene.rests()
    fell_s = (2.0 * (0.5 - 0.01 - 1e-3 * TOP) / G) ** 0.5
    assert scene.body("block").pose.translation[1] < 0.05 + speed[1] * 0.9 * fell_s
    assert scene.handling.state.state == "closed"


def test_a_jammed_gripper_keeps_what_it_holds() -> None:
    scene = holding()
    scene.handling.stick(True)
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("block").state == HELD
    scene.handling.repair()
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("block").state == LIES


def run_of(scene: Scene) -> list[object]:
    """What there is in each tick of picking and putting down."""
    seen: list[object] = []
    controller, step = scene.controller, scene.robot.step

    def tick(ticks: int = 1) -> None:
        for _ in range(ticks):
            step()
            seen.append(
                (controller.joints, controller.cartesian_force(), scene.handling.parts, controller.io.inputs)
            )

    scene.robot.step = tick  # type: ignore[method-assign]
    scene.picks(600, 55, TOP)
    scene.goes(down(600, 50, 450))
    scene.goes(down(560, -50, TOP + 4), 1.0)
    scene.closes(closed=False)
    scene.rests()
    return seen


def test_every_run_is_the_same_to_the_last_bit() -> None:
    parts = ((BLOCK, at(600, 50, TOP)), (PIN, at(500, -100, TOP)))
    assert run_of(Scene(*parts)) == run_of(Scene(*parts))


def test_a_robot_at_rest_may_skip_ticks_with_a_part_in_its_jaws() -> None:
    skips, steps = holding(), holding()
    skips.controller.skip(500)
    steps.robot.step(500)
    for scene in (skips, steps):
        scene.goes(down(500, 0, 450))
    assert skips.controller.cartesian_force() == steps.controller.cartesian_force()
    assert skips.body("block") == steps.body("block")


def test_surfaces_that_come_are_lain_on() -> None:
    scene = holding()
    plate: Surface = TABLE._replace(name="plate", pose=at(600.0, 0.0, 400.0))
    scene.controller.load.world.put(plate)
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("block").on == "plate"


TILE = Part("tile", Box(0.015, 0.015, 0.002), 0.05, 0.5, 5e4)


def test_a_thin_part_pressed_in_with_its_middle_below_the_face_lies_on_it_when_let_go() -> None:
    """2.6 mm of 4 mm: as a stiff robot, or a hard force move, presses it."""
    scene = Scene((TILE, at(600, 50, TABLE_MM + 2.0)))
    scene.picks(600, 50, TABLE_MM + 2.0)
    scene.goes(down(600, 50, TABLE_MM - 0.6), 0.05)
    assert 1e3 * scene.body("tile").pose.translation[2] < TABLE_MM - 0.5
    scene.closes(closed=False)
    scene.rests()
    assert (scene.body("tile").state, scene.body("tile").on) == (LIES, "table")
    assert 1e3 * scene.body("tile").bottom == pytest.approx(TABLE_MM, abs=0.1)


def test_a_thin_part_pressed_up_into_a_plate_from_below_falls() -> None:
    plate: Surface = TABLE._replace(name="plate", pose=at(600.0, 0.0, 500.0))
    scene = Scene((TILE, at(600, 50, TABLE_MM + 2.0)))
    scene.picks(600, 50, TABLE_MM + 2.0)
    scene.goes(down(600, 50, 450.0))
    scene.controller.load.world.put(plate)
    scene.goes(down(600, 50, 480.0 + 0.5), 0.05)
    assert scene.controller.cartesian_force()[2] > 10.0  # along z of a TCP that points down
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("tile").on == "table"


@pytest.mark.parametrize("rise_mm", [5.0, 19.9, 30.0, 80.0])
def test_what_lies_rides_up_with_its_ground(rise_mm: float) -> None:
    """With what lies on it, too."""
    scene = Scene(
        (BALL, at(500, 50, TABLE_MM + 20.0)), (PIN, at(600, 50, TOP)), (BLOCK, at(600, 50, TOP + 60.0))
    )
    before = {name: scene.body(name) for name in ("ball", "pin", "block")}
    scene.controller.load.world.move("table", at(600.0, 0.0, TABLE_MM - 20.0 + rise_mm))
    scene.rests()
    for name, was in before.items():
        now = scene.body(name)
        assert (now.state, now.on) == (LIES, was.on)
        way = np.subtract(now.pose.translation, was.pose.translation)
        assert way == pytest.approx((0.0, 0.0, 1e-3 * rise_mm), abs=1e-9)


def test_what_lies_stays_as_its_ground_goes_sideways_until_it_has_gone() -> None:
    scene = Scene((BLOCK, at(600, 50, TOP)))
    was = scene.body("block")
    scene.controller.load.world.move("table", at(700.0, 0.0, TABLE_MM - 20.0))
    scene.robot.step()
    assert scene.body("block") == was
    scene.controller.load.world.move("table", at(1100.0, 0.0, TABLE_MM - 20.0))
    scene.rests()
    assert scene.body("block").state == GONE


FIRM = JAWS._replace(force_n=1000.0)
SOFT = 3e3  # N/m
SERIES = 1.0 / (1.0 / SOFT + 1.0 / BLOCK.stiffness)


def forces_along(scene: Scene, target: Frame, speed: float) -> np.ndarray:
    """In each tick of a line: the force (N) along base axes, of a TCP that points down, less the weight."""
    scene.controller.move(lin_move(target, speed, 0.0))
    felt = []
    while scene.controller.moving:
        scene.robot.step()
        turn = np.array(scene.controller.tcp().rotation).reshape(3, 3)
        felt.append(turn @ scene.controller.cartesian_force()[:3])
    return np.add(felt, (0.0, 0.0, BLOCK.mass_kg * G))


@pytest.mark.parametrize(("thick_mm", "from_mm"), [(1.0, 425.0), (6.0, 520.0)])
def test_a_held_part_is_pushed_out_of_a_plate_the_way_it_came_in(thick_mm: float, from_mm: float) -> None:
    """Through it, too: k d of the depth behind the face, wherever surfaces have been looked for again."""
    plate = Surface(
        "plate", Box(0.1, 0.1, 5e-4 * thick_mm), at(600.0, 50.0, 380.0 - 0.5 * thick_mm), SOFT, 0.0, 0.3
    )
    scene = holding(jaws=FIRM)
    scene.goes(down(600, 50, from_mm), 0.3)
    scene.controller.load.world.put(plate)
    felt = forces_along(scene, down(600, 50, 400), 0.05)[:, 2]
    depth = 0.38 - scene.body("block").bottom
    assert depth > 0.017
    assert felt[-1] == pytest.approx(SERIES * depth, rel=0.01)
    assert np.diff(felt).min() > -0.1
    assert np.diff(felt).max() < 1.0


def test_a_plate_that_is_moved_into_a_held_part_goes_on_pushing() -> None:
    plate = Surface("plate", Box(0.1, 0.1, 0.003), at(600.0, 50.0, 377.0), SOFT, 0.0, 0.3)
    scene = holding(jaws=FIRM)
    scene.goes(down(600, 50, 421.0), 0.3)
    scene.controller.load.world.put(plate)
    scene.robot.step(3)
    bottom_mm = 1e3 * scene.body("block").bottom
    for top_mm in np.arange(380.0, bottom_mm + 20.0, 1.0):
        scene.controller.load.world.move("plate", at(600.0, 50.0, top_mm - 3.0))
        scene.robot.step(3)
        force = -scene.controller.cartesian_force()[2] + BLOCK.mass_kg * G
        assert force == pytest.approx(SERIES * 1e-3 * max(0.0, top_mm - bottom_mm), abs=0.1)


def test_friction_goes_on_where_other_parts_come_near() -> None:
    """It slides past two that lie, pressed on the table by a millimetre."""
    block, pin, ball = at(600, 200, TOP), at(640, 0, TOP), at(640, -150, TABLE_MM + 20.0)
    scene = Scene((BLOCK, block), (PIN, pin), (BALL, ball), jaws=FIRM)
    scene.picks(600, 200, TOP)
    scene.goes(down(600, 200, TOP - 1.0))
    felt = forces_along(scene, down(560, -200, TOP - 1.0), 0.2)
    normal, along = felt[:, 2], np.hypot(felt[:, 0], felt[:, 1])
    assert normal.min() > 10.0
    fast = slice(300, -300)  # its own inertia aside
    assert along[fast] == pytest.approx(BLOCK.friction * normal[fast], rel=0.01)


def test_after_a_restore_a_held_part_weighs_and_is_pressed_before_the_first_tick() -> None:
    """And lies on what it is pressed into, let go at once."""
    scene = Scene((TILE, at(600, 50, TABLE_MM + 2.0)))
    states = States(scene.controller)
    scene.picks(600, 50, TABLE_MM + 2.0)
    scene.goes(down(600, 50, TABLE_MM - 0.6), 0.05)
    scene.rests()
    pressed = scene.controller.cartesian_force()
    assert pressed[2] < -30.0
    states.save("pressed")
    for between in ("start", "pressed"):
        states.restore(between)
        states.restore("pressed")
        assert scene.controller.cartesian_force() == pressed
        scene.robot.step()
        assert scene.controller.cartesian_force() == pressed
    scene.controller.injected.place(scene.controller.joints)
    # The tips of the jaws, which press on the table, too, stand in it now, and are not felt.
    assert pressed[2] < scene.controller.cartesian_force()[2] < -30.0
    states.restore("start")
    states.restore("pressed")
    scene.handling.lose()
    scene.rests()
    assert scene.body("tile").on == "table"


@pytest.mark.parametrize("lost", [Handling.lose, lambda handling: handling.remove("block")])
def test_stuck_jaws_tell_that_their_part_has_gone_and_close_when_they_are_repaired(
    lost: Callable[[Handling], None],
) -> None:
    scene = holding()
    handling = scene.handling
    handling.stick(True)
    lost(handling)
    scene.rests()
    scene.robot.step(2)
    assert not scene.controller.io.input(HOLDS)
    assert handling.state.state == "between"
    handling.repair()
    scene.rests()
    assert handling.state.state == "closed"
