"""Parts that lie, pushed aside by the arm and by what it holds; and where they block."""

from __future__ import annotations

from math import atan2, degrees

import msgspec
import numpy as np
import pytest

from iiwa_sim.backdoor import surfaces
from iiwa_sim.backdoor.states import States
from iiwa_sim.cell.surfaces import SphereSettings
from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from iiwa_sim.handling.falling import FALLS, HELD, LIES, STILL, Body
from iiwa_sim.handling.part import Part
from tests.asked import lin_move
from tests.handling.scenes import BALL, BLOCK, PIN, TABLE, TABLE_MM, Scene, at, down

G = 9.81
TICK_S = 0.002
TOP = TABLE_MM + 30.0  # of the middle of block and pin
FRICTION_N = BLOCK.friction * BLOCK.mass_kg * G
JAW_MM = 8.0  # closed, one jaw ends so far from the TCP
FREE = (0.0,) * 6


def above(*parts: tuple[Part, object], x: float, y: float, z: float = TOP, **more: object) -> Scene:
    """Jaws closed, beside the parts."""
    scene = Scene(*parts, **more)  # type: ignore[arg-type]
    scene.closes()
    scene.goes(down(x, y, z + 100.0), straight=False)
    scene.goes(down(x, y, z))
    assert scene.controller.cartesian_force() == FREE
    return scene


def pushes(scene: Scene, x: float, y: float, z: float = TOP, speed: float = 0.1) -> np.ndarray:  # type: ignore[type-arg]
    """Along a line; with what it pushes, along x y z of the base, tick by tick."""
    scene.controller.move(lin_move(down(x, y, z), speed, 0.0))
    felt = []
    while scene.controller.moving:
        scene.robot.step()
        fx, fy, fz = scene.controller.cartesian_force()[:3]
        felt.append((-fx, -fy, -fz))
    return np.array(felt)


def looks_anew(scene: Scene) -> None:
    """In the next tick all that is near is looked at, whether it is due or not."""
    pieces, aside = scene.handling.workpieces, scene.handling._aside
    assert pieces is not None
    assert aside is not None
    aside.look_at_all()
    if pieces.in_jaws is not None:
        pieces.in_jaws.touching.slides()


@pytest.mark.parametrize("others", [1, 3], ids=["one", "a row"])
def test_parts_are_looked_at_when_they_are_due_with_the_bits_of_looking_in_each_tick(others: int) -> None:
    """Also where a part of a row has come to rest with friction's springs wound, and nothing presses."""

    def run(always: bool) -> list[object]:
        row = [(BLOCK._replace(name=f"other {k}"), at(600, 50 + 41 * k, TOP)) for k in range(others)]
        scene = Scene((BLOCK, at(520, -120, TOP)), *row)
        scene.picks(520, -120, TOP)
        seen: list[object] = []
        over, pushing, pressed = TOP + 90.0, TOP + 5.0, TOP - 0.5
        ways = [(520, -120, over), (560, -60, pressed), (600, -60, pushing), (600, 30, pushing)]
        ways += [(600, 0, pushing), (560, 20, over)]
        for x, y, z in ways:
            scene.controller.move(lin_move(down(x, y, z), 0.5, 0.0))
            while scene.controller.moving:
                if always:
                    looks_anew(scene)
                scene.robot.step()
                where = [(each.pose, each.velocity) for each in bodies(scene)]
                seen.append((scene.controller.cartesian_force(), where))
        assert place_mm(scene, "other 0")[1] > 60.0
        return seen

    assert run(always=True) == run(always=False)


def bodies(scene: Scene) -> list[Body]:
    assert scene.handling.workpieces is not None
    return list(scene.handling.workpieces.bodies.values())


def test_an_arm_that_has_come_out_of_a_part_it_stood_in_pushes_that_from_then_on() -> None:
    """Its jaws are in the part from the start, which they do not push."""
    wide = BLOCK._replace(shape=Box(0.02, 0.06, 0.06))
    scene = Scene((wide, at(600, 0, TABLE_MM + 60.0)))
    x, y, z = (1e3 * each for each in scene.controller.tcp().translation)
    assert (round(x), round(y)) == (600, 0)
    assert TABLE_MM < z < TABLE_MM + 120.0
    for beside, height in [(600.0, z + 40.0), (540.0, z + 40.0), (540.0, z - 30.0)]:
        scene.goes(down(beside, 0.0, height))
    assert place_mm(scene)[0] == 600.0
    pushes(scene, 600.0, 0.0, z - 30.0)
    assert place_mm(scene)[0] > 620.0
    assert scene.controller.last_error is None


def test_parts_that_move_are_taken_in_the_order_of_the_cell() -> None:
    """In that of a set of names the same commands would lead to other bits in another process."""
    names = [f"part {number}" for number in range(12)]
    scene = Scene(*((BLOCK._replace(name=name), at(400 + 30 * k, 0, TOP)) for k, name in enumerate(names)))
    pieces = scene.handling.workpieces
    assert pieces is not None
    for name in reversed(names):
        pieces.put_aside(pieces.bodies[name]._replace(velocity=(0.1, 0.0, 0.0)))
    assert pieces.moving == names


def place_mm(scene: Scene, name: str = "block") -> np.ndarray:  # type: ignore[type-arg]
    return 1e3 * np.array(scene.body(name).pose.translation)


@pytest.mark.parametrize("part", [BLOCK, PIN, BALL], ids=lambda part: part.name)
def test_a_part_is_pushed_along_the_table_and_stops_when_it_is_no_longer_pushed(part: Part) -> None:
    scene = above((part, at(600, 50, TABLE_MM + 1e3 * part.reach(at(0, 0, 0).rotation, 2))), x=600, y=0)
    height = place_mm(scene, part.name)[2]
    felt = pushes(scene, 600, 100)
    steady = felt[len(felt) // 2 : len(felt) * 3 // 4, 1]
    if part is BALL:  # it is pushed above its middle, and so down, too
        assert (steady > part.friction * part.mass_kg * G).all()
    else:
        assert steady == pytest.approx(np.full(len(steady), part.friction * part.mass_kg * G), rel=0.05)
    body = scene.body(part.name)
    half = 1e3 * part.reach(body.pose.rotation, 1)
    assert place_mm(scene, part.name) == pytest.approx(
        (600.0, 100.0 + JAW_MM + half, height), abs=6.0 if part is BALL else 1.0
    )
    scene.goes(down(600, 80, TOP))
    assert scene.controller.cartesian_force() == FREE
    scene.rests()
    there = scene.body(part.name)
    assert (there.state, there.velocity, there.spin, there.wound) == (LIES, STILL, 0.0, ())
    scene.goes(down(600, 60, TOP))
    scene.rests()
    assert scene.body(part.name) == there


def test_pushed_off_its_middle_it_turns() -> None:
    scene = above((BLOCK, at(600, 50, TOP)), x=587, y=0)
    pushes(scene, 587, 60)
    rotation = scene.body("block").pose.rotation
    turned = degrees(atan2(rotation[3], rotation[0]))
    assert -90.0 < turned < -10.0, "the side that is pushed goes ahead"
    assert rotation[8] == pytest.approx(1.0), "and it stays upright"


def test_between_arm_and_wall_it_blocks_until_the_robot_protects_itself() -> None:
    wall = Surface("wall", Box(0.1, 0.01, 0.05), at(600, 160, TABLE_MM + 50.0), 5e4, 0.0, 0.3)
    scene = above((BLOCK, at(600, 50, TOP)), x=600, y=0, surfaces=(TABLE, wall))
    felt = pushes(scene, 600, 118)
    assert felt[:, 1].max() > 200.0
    assert scene.robot.faults
    assert 150.0 - 20.0 <= place_mm(scene)[1] < 150.0 - 20.0 + 12.0, "at the wall, a little in it"


def test_over_the_edge_of_what_it_lies_on_it_falls() -> None:
    small = Surface("table", Box(0.4, 0.27, 0.02), at(600, 0, TABLE_MM - 20.0), 2e4, 0.0, 0.3)
    scene = above((BLOCK, at(600, 250, TOP)), x=600, y=200, surfaces=(small,))
    pushes(scene, 600, 260)
    assert scene.body("block").state == FALLS
    assert not scene.robot.faults
    assert scene.controller.cartesian_force() == FREE


def test_parts_push_each_other_and_carry_what_lies_on_them_along() -> None:
    second, third = BLOCK._replace(name="second"), PIN._replace(name="third")
    tile = Part("tile", Box(0.01, 0.01, 0.005), 0.05, 0.5, 5e4)
    scene = above(
        (BLOCK, at(600, 50, TOP)),
        (second, at(600, 95, TOP)),
        (third, at(600, 140, TOP)),
        (tile, at(595, 95, TOP + 35.0)),
        x=600,
        y=0,
    )
    felt = pushes(scene, 600, 60)
    rubs = 0.5 * G * (0.5 + 0.5 + 0.05 + 0.3)
    assert felt[-160:-40, 1].mean() == pytest.approx(rubs, rel=0.2)
    first, along, last = (place_mm(scene, name)[1] for name in ("block", "second", "third"))
    assert first == pytest.approx(60.0 + JAW_MM + 20.0, abs=1.0)
    assert along == pytest.approx(first + 40.0, abs=1.0)
    assert last == pytest.approx(along + 35.0, abs=1.0)
    assert scene.body("tile").on == "second"
    assert place_mm(scene, "tile") == pytest.approx((595.0, along, TOP + 35.0), abs=1.5)


def test_pressed_from_above_it_presses_on_the_table() -> None:
    """Three springs in a row: jaws in the part, part in the table."""
    scene = above((BLOCK, at(600, 50, TOP)), x=600, y=50, z=TOP + 35.0)
    pushes(scene, 600, 50, TOP + 29.0, speed=0.01)
    scene.rests()
    force = -scene.controller.cartesian_force()[2]
    # Both jaws have the part's stiffness, which lies on part and table in a row.
    soft = 1.0 / (1.0 / 1e5 + 1.0 / 5e4 + 1.0 / 2e4)
    assert force == pytest.approx(soft * 1e-3 * (1.0 - BLOCK.mass_kg * G / 2e4 * 1e3 * 1.4), rel=0.02)
    assert place_mm(scene)[:2] == pytest.approx((600.0, 50.0), abs=0.05)
    assert scene.body("block").state == LIES


def test_a_held_part_pushes_others_and_is_felt() -> None:
    wide = Part("wide", Box(0.05, 0.015, 0.02), 0.4, 0.5, 5e4)
    scene = Scene((wide, at(600, 50, TABLE_MM + 20.0)), (BLOCK, at(600, 140, TOP)))
    scene.picks(600, 50, TABLE_MM + 25.0)
    scene.goes(down(600, 50, TABLE_MM + 30.0))
    assert scene.body("wide").state == HELD
    at_first = place_mm(scene)[1]
    felt = pushes(scene, 600, 140, TABLE_MM + 30.0)
    assert felt[len(felt) // 2 : -50, 1].mean() == pytest.approx(FRICTION_N, rel=0.15)
    assert place_mm(scene)[1] > at_first + 20.0
    assert scene.body("block").state == LIES
    assert not scene.robot.faults


@pytest.mark.parametrize(("held", "below", "drags"), [(0.5, 0.1, True), (0.1, 0.5, False)])
def test_a_held_part_drags_what_it_presses_on_as_far_as_its_friction_goes(
    held: float, below: float, *, drags: bool
) -> None:
    """It feels the friction of the plate on the table where it drags that, else its own on the plate."""
    plate = Part("plate", Box(0.05, 0.05, 0.01), 0.4, below, 5e4)
    scene = Scene((BLOCK._replace(friction=held), at(600, 100, TOP)), (plate, at(600, -60, TABLE_MM + 10.0)))
    scene.picks(600, 100, TABLE_MM + 20.0)
    scene.goes(down(600, 100, TABLE_MM + 80.0))
    scene.goes(down(600, -60, TABLE_MM + 80.0))
    above_mm = 1e3 * scene.body("block").pose.translation[2] - 50.0 - TABLE_MM
    z_mm = TABLE_MM + 80.0 - above_mm - 0.5
    scene.rests()
    free_n = scene.controller.cartesian_force()[2]
    scene.goes(down(600, -60, z_mm), speed=0.05)
    scene.rests()
    pressed_n = abs(scene.controller.cartesian_force()[2] - free_n)
    assert pressed_n > 1.0
    felt = pushes(scene, 600, -100, z_mm, speed=0.05)[:, 1]
    gone_mm = 1e3 * scene.body("plate").pose.translation[1] + 60.0
    limit_n = below * (plate.mass_kg * G + pressed_n) if drags else held * pressed_n
    assert abs(felt[len(felt) // 2]) == pytest.approx(limit_n, rel=0.1)
    assert gone_mm == pytest.approx(-40.0 if drags else 0.0, abs=1.0)
    assert not scene.robot.faults


def test_the_same_commands_give_the_same_bits_and_go_on_so_after_a_restore() -> None:
    def run(*, away: bool) -> list[object]:
        scene = above((BLOCK, at(600, 50, TOP)), (PIN, at(605, 95, TOP)), x=590, y=0)
        pushes(scene, 590, 40)
        scene.rests()
        before = scene.handling.parts, scene.controller.cartesian_force()
        assert any(before[1])
        states = States(scene.controller)
        states.save("pushed")
        if away:
            scene.goes(down(590, 0, TOP))
        states.restore("pushed")
        told: list[object] = []
        assert (scene.handling.parts, scene.controller.cartesian_force()) == before
        scene.robot.step(5)
        scene.controller.move(lin_move(down(600, 80, TOP), 0.1, 0.0))
        for _ in range(300):
            scene.robot.step()
            told.append((scene.handling.parts, scene.controller.cartesian_force()))
        return told

    once = run(away=False)
    assert once == run(away=False)
    assert once == run(away=True)


def test_far_from_parts_an_arm_moves_and_feels_as_without_them() -> None:
    """And a part that nobody comes near costs no look."""
    near, without = Scene((BLOCK, at(600, 400, TOP))), Scene((BLOCK, at(-600, 400, TABLE_MM - 300.0)))
    for scene in (near, without):
        scene.goes(down(600, -100, 500), straight=False)
        scene.goes(down(500, -200, 450))
    assert near.robot.joints == without.robot.joints
    assert near.controller.cartesian_force() == without.controller.cartesian_force() == FREE
    assert near.body("block").pose == Scene((BLOCK, at(600, 400, TOP))).body("block").pose


def test_no_surface_is_put_round_a_part_nor_moved_onto_one_that_lies_on_another() -> None:
    scene = Scene((BLOCK, at(600, 50, TOP)))
    ball = SphereSettings(name="ball", radius_mm=50.0, x_mm=600.0, y_mm=50.0, z_mm=TOP, stiffness_n_per_m=1e4)
    with pytest.raises(Refused, match="part 'block' would be within surface 'ball'"):
        surfaces.add(scene.controller, ball)
    surfaces.add(scene.controller, msgspec.structs.replace(ball, y_mm=300.0))
    with pytest.raises(Refused, match="part 'block' would be within surface 'ball'"):
        surfaces.move(scene.controller, "ball", Frame(600.0, 60.0, TOP, 0.0, 0.0, 0.0))
    assert scene.body("block").on == "table"
    surfaces.move(scene.controller, "table", Frame(600.0, 0.0, TABLE_MM + 30.0, 0.0, 0.0, 0.0))
    scene.robot.step(2)
    assert scene.body("block").on == "table", "it has ridden up with what it lies on"
    assert place_mm(scene)[2] == pytest.approx(TOP + 50.0, abs=1.0)
