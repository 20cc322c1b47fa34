"""Force moves against real surfaces: where the robot stops, and what it feels there.

What should come of each is found without the code under test. A move is run in free space first: that is its
path over time, which no contact changes. Where on it the stop ends follows from the time law of the stop, in
closed form; what is felt there from stiffness times depth.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.cell.cell import Cell
from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.force_guard import Thresholds
from iiwa_sim.frames import IDENTITY, Frame, Transform
from iiwa_sim.robot.description import RobotDescription, load_robot
from tests import asked
from tests.stepped import ARMS, Array, SteppedRobot, assert_within_limits, strong

Law = Callable[[Array, Array], Array]
"""Forces (n, 3) in the base on a probe that has been at positions (n, 3), m, with velocities (n, 3), m/s."""

RADIUS = 0.003
START_MM = {ARMS[0]: (600.0, 0.0, 410.410161514), ARMS[1]: (445.0, 0.0, 660.0)}
"""Where home is for a tool of 150 mm, which then points down: its x and z are against those of the base."""
CLOSE = 0.01
DEPTH_MM = 150.0
UP = np.array([0.0, 0.0, 1.0])
names = st.sampled_from(ARMS)

speeds = st.floats(0.02, 1.0)
stiffnesses = st.sampled_from([1e3, 5e3, 2e4, 1e5])
thresholds = st.floats(0.5, 60.0)


def probe(robot: str | RobotDescription, *surfaces: Surface) -> SteppedRobot:
    """A robot with a probe that points down at START_MM, among surfaces."""
    tool = Frame(0.0, 0.0, 150.0, 0.0, 0.0, 0.0).to_transform()
    description = load_robot(robot) if isinstance(robot, str) else robot
    return SteppedRobot(cell=Cell(description, description.home, tool, RADIUS, surfaces))


def beside(robot: SteppedRobot, x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 0.0) -> Frame:
    """A frame turned as the TCP is, so far from it in the axes of the base."""
    here = robot.controller.tool_frame()
    return here._replace(x_mm=here.x_mm + x_mm, y_mm=here.y_mm + y_mm, z_mm=here.z_mm + z_mm)


def flat(
    point: Array, normal: Array, stiffness: float, *, damping: float = 0.0, friction: float = 0.0
) -> Law:
    """Of a flat surface, for a way straight into it; with friction for one that slips all the way."""

    def law(positions: Array, velocities: Array) -> Array:
        depth = np.maximum(RADIUS - (positions - point) @ normal, 0.0)
        pressed = stiffness * depth * np.maximum(1.0 - damping * (velocities @ normal), 0.0)
        forces = pressed[:, None] * normal
        if friction and depth.any():
            gone = positions - positions[np.flatnonzero(depth)[0]]
            gone -= (gone @ normal)[:, None] * normal
            length = np.linalg.norm(gone, axis=1)
            held = np.minimum(stiffness * length, friction * pressed)
            forces -= gone * (held / np.where(length > 0.0, length, 1.0))[:, None]
        return forces

    return law


class Touched(NamedTuple):
    """What should come of a force move."""

    tick: int
    """In which the force has left its threshold."""
    force_n: float
    """Then, along the axis that is watched."""
    place: Array
    """Of the TCP then (m)."""
    rest: Array
    """Of the TCP when it has stopped (m)."""
    rest_force: Array
    """(3,) N, along the axes of the TCP, when it has stopped."""


class Way:
    """What a robot does in free space, at all times."""

    def __init__(self, name: str, moves: Callable[[SteppedRobot], object], override: float = 1.0) -> None:
        self._robot = probe(name)
        self._robot.controller.set_override(override)
        self._override = override
        moves(self._robot)
        self._robot.runs_until_stopped()
        self.joints = self._robot.joints

    def tcp(self, tick: float) -> Transform:
        """Between ticks by the cubic through the four around it."""
        if tick >= len(self.joints) - 1:
            return self._robot.tcp(self.joints[-1])
        first = min(max(int(tick) - 1, 0), len(self.joints) - 4)
        nodes = np.arange(first, first + 4)
        weights = [
            np.prod([(tick - other) / (node - other) for other in nodes if other != node]) for node in nodes
        ]
        return self._robot.tcp((np.array(weights) @ np.array(self.joints[first : first + 4])).tolist())

    def touch(self, law: Law, axis: int, threshold: float, offset_n: float = 0.0) -> Touched:
        """What comes of a force move that watches one axis of the TCP, from tick 0."""
        tick_s = self._robot.tick_s
        poses = [self._robot.tcp(joints) for joints in self._robot.joints]
        positions = np.array([pose.translation for pose in poses])
        velocities = np.diff(positions, axis=0, prepend=positions[:1]) / tick_s
        felt = in_tcp(law(positions, velocities), poses)
        tick = int(np.flatnonzero(np.abs(felt[:, axis] - offset_n) > threshold)[0])
        after_s = self.stop_s / 2.0  # the rate of time falls evenly: the mean of it is a half
        end = self.tcp(tick + after_s / tick_s)
        way = np.vstack([positions[: tick + 1], end.translation])
        still = np.vstack([velocities[: tick + 1], np.zeros(3)])
        return Touched(
            tick=tick,
            force_n=float(felt[tick, axis]),
            place=positions[tick],
            rest=np.array(end.translation),
            rest_force=in_tcp(law(way, still), [*poses[: tick + 1], end])[-1],
        )

    @property
    def stop_s(self) -> float:
        """How long the rate of time takes to fall to 0 with a bounded slope that has a bounded slope."""
        robot = self._robot.description
        slope, bend = robot.stop_rate_per_s, robot.stop_rate_change_per_s2
        if self._override > slope**2 / bend:
            return self._override / slope + slope / bend
        return 2.0 * sqrt(self._override / bend)


def in_tcp(forces: Array, poses: list[Transform]) -> Array:
    """Forces (n, 3) in the base along the axes of the TCP."""
    turns = np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3)
    turned: Array = np.einsum("nij,ni->nj", turns, forces)
    return turned


def assert_touched(robot: SteppedRobot, way: Way, expected: Touched) -> None:
    """The one contact there was, and the stop that began in the tick after it, are what they should be."""
    robot.runs_until_stopped()
    tick = expected.tick
    (contact,) = robot.contacts
    assert contact.force_n == pytest.approx(expected.force_n, rel=1e-6)
    assert np.multiply(contact.tcp[:3], 1e-3) == pytest.approx(expected.place, abs=1e-12)
    assert robot.joints[: tick + 1] == way.joints[: tick + 1]
    assert robot.joints[tick + 1] != way.joints[tick + 1]
    assert (len(robot.joints) - 1 - tick) * robot.tick_s == pytest.approx(way.stop_s, abs=robot.tick_s)
    rest = np.array(robot.tcp(robot.controller.joints).translation)
    overshoot = np.linalg.norm(expected.rest - expected.place)
    assert np.linalg.norm(rest - expected.rest) <= CLOSE * overshoot
    force = np.array(robot.controller.cartesian_force()[:3])
    assert np.linalg.norm(force - expected.rest_force) <= CLOSE * np.linalg.norm(expected.rest_force)
    assert_within_limits(robot)


def force_move(kind: str, target: Frame, speed: float, each: Thresholds) -> Callable[[SteppedRobot], int]:
    return lambda robot: robot.controller.move(getattr(asked, f"{kind}_force_move")(target, speed, 0.0, each))


def move(kind: str, target: Frame, speed: float) -> Callable[[SteppedRobot], int]:
    return lambda robot: robot.controller.move(getattr(asked, f"{kind}_move")(target, speed, 0.0))


def watching(axis: str, threshold: float) -> Thresholds:
    x, y, z = (threshold if each == axis else None for each in "xyz")
    return (x, y, z)


def table(
    name: str, below_mm: float, stiffness: float, *, damping: float = 0.0, friction: float = 0.0
) -> tuple[Surface, Law]:
    """Its top so far below the probe's start, counted from the TCP."""
    top = np.multiply(START_MM[name], 1e-3) - 1e-3 * below_mm * UP
    pose = Transform(IDENTITY.rotation, (0.0, 0.0, float(top[2])))
    surface = Surface("table", Plane(), pose, stiffness, damping, friction)
    return surface, flat(top, UP, stiffness, damping=damping, friction=friction)


@pytest.mark.requirement("FRC005", "FRC008", "FRC009")
@given(
    kind=st.sampled_from(["lin", "ptp"]),
    name=names,
    speed=speeds,
    stiffness=stiffnesses,
    threshold=thresholds,
    damping=st.sampled_from([0.0, 0.5, 3.0]),
    override=st.sampled_from([1.0, 1.0, 0.5, 0.1]),
)
def test_down_onto_a_table(
    name: str, kind: str, speed: float, stiffness: float, threshold: float, damping: float, override: float
) -> None:
    surface, law = table(name, 20.0, stiffness, damping=damping)
    robot = probe(name, surface)
    robot.controller.set_override(override)
    target = beside(robot, z_mm=-DEPTH_MM)
    force_move(kind, target, speed, watching("z", threshold))(robot)
    way = Way(name, move(kind, target, speed), override)
    assert_touched(robot, way, way.touch(law, 2, threshold))


@pytest.mark.requirement("FRC014")
@pytest.mark.parametrize("name", ARMS)
def test_moves_behind_a_touch_run_on(name: str) -> None:
    robot = probe(name, table(name, 20.0, 2e4)[0])
    down, up, aside = beside(robot, z_mm=-60.0), beside(robot), beside(robot, y_mm=100.0)
    touching = force_move("lin", down, 0.05, watching("z", 10.0))(robot)
    left = force_move("lin", up, 0.5, (5.0, 5.0, 200.0))(robot)
    last = move("ptp", aside, 0.5)(robot)
    while not robot.contacts:
        robot.step()
    c = robot.controller
    assert [c.is_pending(number) for number in (touching, left, last)] == [False, True, True]
    assert c.queue == 2
    robot.runs_until_stopped()
    assert [contact.move for contact in robot.contacts] == [touching]
    assert c.tool_frame() == pytest.approx(aside, abs=1e-6)
    assert c.cartesian_force() == (0.0,) * 6
    assert robot.faults == []
    assert_within_limits(robot)


@pytest.mark.parametrize("name", ARMS)
def test_each_force_move_counts_from_the_force_at_its_own_command(name: str) -> None:
    robot = probe(strong(name), table(name, 20.0, 2e4)[0])
    c = robot.controller
    down, up = beside(robot, z_mm=-60.0), beside(robot)
    first = force_move("lin", down, 0.2, watching("z", 10.0))(robot)
    queued = force_move("lin", down, 0.2, watching("z", 10.0))(robot)  # at this command there is no force
    robot.runs_until_stopped()
    assert [contact.move for contact in robot.contacts] == [first, queued]
    held_n = c.cartesian_force()[2]
    assert held_n < -10.0
    here = c.tool_frame()
    deeper = force_move("lin", down, 0.02, watching("z", 5.0))(robot)
    robot.runs_until_stopped()
    contact = robot.contacts[-1]
    assert (contact.move, contact.offset_n) == (deeper, held_n)
    assert held_n - 2.0 * 5.0 < contact.force_n < held_n - 5.0
    assert here.z_mm - 3.0 < c.tool_frame().z_mm < here.z_mm - 0.25
    held_n = c.cartesian_force()[2]
    leaving = force_move("lin", up, 0.05, watching("z", 5.0))(robot)  # less force is a change, too
    robot.runs_until_stopped()
    contact = robot.contacts[-1]
    assert (contact.move, contact.offset_n) == (leaving, held_n)
    assert contact.force_n > held_n + 5.0
    assert c.tool_frame().z_mm < up.z_mm - 1.0
    assert_within_limits(robot)
