"""Parts that block between the arm and a wall: nothing goes through anything, however thin it is."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from iiwa_sim.backdoor.states import States
from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame, Vector, apply, inverse
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part
from tests.asked import lin_move
from tests.handling.scenes import BALL, BLOCK, DOWN, PIN, TABLE, TABLE_MM, Scene, at, down
from tests.samples import some

G = 9.81
TOP = TABLE_MM + 30.0
HARD_TABLE = TABLE._replace(stiffness=5e4)
TICK_S = 0.002


def wall_at(front_mm: float, thick_mm: float, stiffness: float = 5e4, direction: float = 0.0) -> Surface:
    """A wall across a way along y, turned about the vertical at (600, 100); its face is so far along it."""
    way = front_mm - 100.0 + 0.5 * thick_mm
    x, y = 600.0 - way * sin(direction), 100.0 + way * cos(direction)
    shape = Box(0.1, 5e-4 * thick_mm, 0.05)
    return Surface("wall", shape, at(x, y, TABLE_MM + 50.0, direction), stiffness, 0.0, 0.3)


class Push:
    """A part at (600, 100) that jaws push along y, or along a direction from there (rad), onto a wall 40 mm
    behind it."""

    def __init__(self, wall: Surface, *, closed: bool, part: Part = BLOCK, direction: float = 0.0) -> None:
        height = TABLE_MM + 1e3 * part.reach(at(0, 0, 0).rotation, 2)
        self.part = part
        self.scene = Scene((part, at(600, 100, height, direction)), surfaces=(HARD_TABLE, wall))
        self._direction = direction
        self._height = height
        self._wall = wall
        if closed:
            self.scene.closes()
        way = -35.0 if closed else -80.0  # open jaws are 48 mm to each side
        self.scene.goes(self._frame(way, 100.0), straight=False)
        self.scene.goes(self._frame(way, 0.0))

    def _frame(self, way_mm: float, above_mm: float = 0.0) -> Frame:
        x, y = 600.0 - way_mm * sin(self._direction), 100.0 + way_mm * cos(self._direction)
        return Frame(x, y, self._height + above_mm, DOWN[0] + self._direction, 0.0, DOWN[2])

    def goes(self, way_mm: float, speed: float) -> None:
        """Towards a place so far along the way, until the robot stands; nothing may go through anything."""
        scene = self.scene
        scene.controller.move(lin_move(self._frame(way_mm), speed, 0.0))
        for _ in range(20_000):
            scene.robot.step()
            self.check()
            if not scene.controller.moving and scene.controller.resting:
                return
        raise AssertionError("it does not come to rest")

    def check(self) -> None:
        """The middle of the part is before the wall, and the TCP, or its nearest jaw, before that."""
        body = self.scene.body(self.part.name)
        assert body.state == LIES
        seen = inverse(self._wall.pose)
        middle = apply(seen, body.pose.translation)
        shape = self._wall.shape
        assert isinstance(shape, Box)
        assert middle[1] < -shape.half_y, "the wall holds it"
        assert abs(middle[0]) < 0.01, "it is not shot away along the wall"
        jaw = 0.5 * self.scene.handling.gripper.opening_m
        tcp = self.scene.controller.tcp().translation
        assert self._along(tcp) + jaw < self._along(body.pose.translation), "no jaw comes through the part"

    def _along(self, place: Vector) -> float:
        """How far (m) a place in the base is along the way."""
        return cos(self._direction) * place[1] - sin(self._direction) * place[0]


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "open"])
@pytest.mark.parametrize("speed", [0.05, 0.1, 0.15, 0.2, 0.3, 0.5])
def test_between_jaws_and_a_wall_of_10_mm_a_block_holds_until_the_robot_protects_itself(
    speed: float, closed: bool
) -> None:
    push = Push(wall_at(160.0, 10.0), closed=closed)
    push.goes(130.0, speed)
    assert push.scene.robot.faults, "it has not stopped for itself"


@pytest.mark.parametrize("part", [PIN, BALL], ids=lambda part: part.name)
def test_what_is_round_holds_too(part: Part) -> None:
    push = Push(wall_at(160.0, 10.0), closed=True, part=part)
    push.goes(130.0, 0.1)
    assert push.scene.robot.faults


@settings(max_examples=some(40), deadline=None)
@given(
    speed=st.floats(0.05, 0.5),
    thick_mm=st.floats(1.0, 60.0),
    stiffness=st.floats(3e4, 2e5),
    direction=st.floats(-0.6, 0.6),
    closed=st.booleans(),
)
@example(speed=0.5, thick_mm=1.0, stiffness=5e4, direction=0.0, closed=False)
def test_no_wall_is_passed(
    speed: float, thick_mm: float, stiffness: float, direction: float, closed: bool
) -> None:
    push = Push(wall_at(160.0, thick_mm, stiffness, direction), closed=closed, direction=direction)
    push.goes(130.0, speed)
    assert push.scene.robot.faults


def test_jaws_do_not_go_through_a_thin_wall() -> None:
    """A wall of 8 mm in the way of closed jaws, without a part."""
    wall = Surface("wall", Box(0.1, 0.004, 0.05), at(600, 60, TABLE_MM + 50.0), 2e4, 0.0, 0.3)
    scene = Scene(surfaces=(HARD_TABLE, wall))
    scene.closes()
    scene.goes(down(600, 0, TOP + 100.0), straight=False)
    scene.goes(down(600, 0, TOP))
    scene.controller.move(lin_move(down(600, 150, TOP), 0.15, 0.0))
    most = 0.0
    while scene.controller.moving:
        scene.robot.step()
        most = max(most, -scene.controller.cartesian_force()[1])
        assert scene.controller.cartesian_force()[1] <= 0.0, "it is pushed out the way it has come in"
    assert scene.robot.faults
    assert most > 250.0


def test_what_presses_past_the_middle_of_a_wall_goes_on_so_after_a_restore() -> None:
    def run(*, away: bool) -> list[object]:
        push = Push(wall_at(160.0, 4.0), closed=True)
        push.goes(17.0, 0.05)
        scene = push.scene
        assert not scene.robot.faults
        assert 1e3 * scene.body("block").pose.translation[1] > 142.1, "it is past the middle of the wall"
        states = States(scene.controller)
        states.save("pressed")
        before = scene.handling.parts, scene.controller.cartesian_force()
        if away:
            scene.goes(push._frame(-35.0))
        states.restore("pressed")
        assert (scene.handling.parts, scene.controller.cartesian_force()) == before
        told: list[object] = []
        scene.controller.move(lin_move(push._frame(18.0), 0.05, 0.0))
        for _ in range(200):
            scene.robot.step()
            told.append((scene.handling.parts, scene.controller.cartesian_force()))
        return told

    once = run(away=False)
    assert once == run(away=False)
    assert once == run(away=True)


@settings(max_examples=some(150), deadline=None)
@given(
    part=st.sampled_from([BLOCK, PIN, BALL, Part("thin", Box(0.03, 0.004, 0.02), 0.2, 0.3, 2e5)]),
    velocity=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    spin=st.floats(-15.0, 15.0),
    walls=st.lists(
        st.tuples(st.floats(-3.1, 3.1), st.floats(-0.7, 0.7), st.floats(1.0, 30.0), st.floats(4.0, 6.0)),
        min_size=1,
        max_size=3,
    ),
    other=st.booleans(),
)
def test_a_part_that_slides_into_thin_walls_and_another_part_gains_no_energy(
    part: Part,
    velocity: tuple[float, float],
    spin: float,
    walls: list[tuple[float, float, float, float]],
    other: bool,
) -> None:
    """Against the least there has been: of motion, of height, and of all springs."""
    surfaces = [HARD_TABLE]
    for number, (angle, turned, thick_mm, power) in enumerate(walls):
        x, y = 600.0 + 60.0 * np.cos(angle), 60.0 * np.sin(angle)
        pose = at(float(x), float(y), TABLE_MM + 50.0, angle + turned)
        shape = Box(5e-4 * thick_mm, 0.05, 0.05)
        surfaces.append(Surface(f"wall {number}", shape, pose, 10.0**power, 0.0, 0.3))
    height = TABLE_MM + 1e3 * part.reach(at(0, 0, 0).rotation, 2)
    parts = [(part._replace(name="it"), at(600, 0, height))]
    if other:
        parts.append((BLOCK, at(600, 300, TOP)))  # it lies there, and nobody comes near
    scene = Scene(*parts, surfaces=tuple(surfaces))
    pieces = scene.handling.workpieces
    assert pieces is not None
    pieces.put_aside(pieces.bodies["it"]._replace(velocity=(*velocity, 0.0), spin=spin))

    def energy() -> float:
        body = pieces.bodies["it"]
        x, y, z = body.velocity
        moments = body.part.moments(body.pose._replace(translation=(0.0, 0.0, 0.0)))
        total = 0.5 * body.part.mass_kg * (x * x + y * y + z * z)
        total += 0.5 * (moments.xx + moments.yy) * body.spin**2
        total += body.part.mass_kg * G * body.pose.translation[2]
        face = pieces.face_below("it")
        assert face is not None
        soft = face.stiffness_below(body.part)
        total += 0.5 * soft * max(0.0, face.top - body.bottom) ** 2
        total += 0.125 * soft * sum(each * each for each in body.wound)
        return total + pieces.crowd.stored_j

    least = energy()
    for _ in range(200):
        scene.robot.step()
        if pieces.bodies["it"].state != LIES:
            return
        now = energy()
        assert now <= least + 1e-9 * max(1.0, least)
        least = min(least, now)
