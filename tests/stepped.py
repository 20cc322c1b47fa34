"""A robot in simulated time, and checks of its motion, tick by tick."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from iiwa_sim.cell.cell import Cell
from iiwa_sim.controller.endings import Contact, RobotEvent
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.modes import Mode
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.robot.description import RobotDescription, built_in_robots, load_robot
from iiwa_sim.robot.model import arm_model
from tests.requests import joint_move

Array = NDArray[np.float64]

ROBOTS = built_in_robots()
ARMS = ("lbr_iiwa_7_r800", "kr_6_r900_sixx")
"""One of each kind of arm; properties of any robot are tested on both."""
ALL_ROBOTS = [name if name in ARMS else pytest.param(name, marks=pytest.mark.slow) for name in ROBOTS]
"""Parameters for tests: `make test` leaves a second arm of a kind to `make test-slow`."""
STIFF = (Mode.DIRECT, Mode.TRAJECTORY)
"""The modes with the limits of direct moves."""
TOLERANCE = 1.01  # of planned acceleration
VELOCITY_TOLERANCE, JERK_TOLERANCE = 1.005, 1.05
ROUNDING = 1e-9
CHANGE_S = 0.4
"""A change of the override takes no longer."""


def strong(name: str) -> RobotDescription:
    """Return a robot that no force stops, for tests beyond the torque limits of its joints."""
    description = load_robot(name)
    return replace(description, torque=(1e9,) * len(description.joints))


class SteppedRobot:
    """A controller whose every tick is recorded."""

    def __init__(
        self,
        robot: str | RobotDescription = "lbr_iiwa_7_r800",
        tick_s: float = 0.002,
        servo_timeout_s: float | None = None,
        cell: Cell | None = None,
    ) -> None:
        """A `cell` has a robot of its own."""
        if cell is None:
            alone = load_robot(robot) if isinstance(robot, str) else robot
            cell = Cell(alone, alone.home, alone.tool_in_flange)
        self.description = cell.description
        self.tool_in_flange = cell.tool_in_flange
        self.faults: list[tuple[int, str]] = []
        self.contacts: list[Contact] = []
        self.controller = cell.controller(
            tick_s,
            servo_timeout_s=servo_timeout_s,
            on_event=self._on_event,
        )
        self.model = arm_model(self.description)
        self.tick_s = tick_s
        self.joints = [self.controller.joints]
        self.stopping = [False]
        self.direct = [False]
        self._mode = self.controller.mode
        self._override = self.controller.override
        self._stop_ticks = 0  # in which the robot may still be stopping, or changing to an override
        self._direct_ticks = 0  # in which the limits of direct mode may still be needed

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.notice_mode()
            self.controller.step()
            self.notice_mode()  # the controller may have stopped by itself
            self.joints.append(self.controller.joints)
            self.stopping.append(self._stop_ticks > 0)
            self.direct.append(self._direct_ticks > 0)
            self._stop_ticks -= 1
            self._direct_ticks -= 1

    def stop(self) -> None:
        self.notice_mode()
        self.controller.stop()
        self.may_stop()

    def cancel(self) -> None:
        self.notice_mode()
        self.controller.cancel_move()
        self.may_stop()

    def may_stop(self) -> None:
        """Use the limits of a stop from now on, for its longest duration."""
        self._stop_ticks = max(self._stop_ticks, self._longest_stop)

    def clears_queue(self, running: int) -> bool:
        """Clear the queue; return True if the running move will reach its target."""
        self.notice_mode()
        self.controller.clear_queue()
        goes_on = self.controller.motions.is_pending(running)
        if not goes_on:
            self.may_stop()
        return goes_on

    def _on_event(self, event: RobotEvent) -> None:
        if isinstance(event, ErrorRecord):
            self.faults.append((event.code, event.reason))
        elif isinstance(event, Contact):
            self._on_contact(event)

    def _on_contact(self, contact: Contact) -> None:
        self.contacts.append(contact)
        self._stop_ticks = self._longest_stop + 1  # it begins in the next tick

    @property
    def redundant(self) -> bool:
        """True if A3 can be chosen."""
        return self.description.kinematics == "srs"

    @property
    def _longest_stop(self) -> int:
        return round(0.1 / self.tick_s)

    def notice_mode(self) -> None:
        """To be called between two changes of mode, or of the override, in one tick."""
        mode = self.controller.mode
        if self.controller.override != self._override:
            self._override = self.controller.override
            self._stop_ticks = round(CHANGE_S / self.tick_s)
        if mode is not self._mode:
            if self._mode is not Mode.UNKNOWN:
                self.may_stop()
            if self._mode in STIFF:
                self._direct_ticks = self._longest_stop
            self._mode = mode
        if mode in STIFF:
            self._direct_ticks = self._longest_stop

    def runs_until_stopped(self, limit_s: float = 600.0) -> int:
        """Step until the robot is at rest; return the ticks."""
        ticks = 0
        while self.controller.moving:
            self.step()
            ticks += 1
            assert ticks * self.tick_s < limit_s, "still moving"
        return ticks

    def goes_to(self, joints: Sequence[float]) -> None:
        """Run to joint positions at full speed, and forget the recorded motion."""
        self.controller.move(joint_move(joints, [1.0] * len(joints)))
        self.runs_until_stopped()
        self.joints, self.stopping, self.direct = [self.controller.joints], [False], [False]

    def tcp(self, joints: Sequence[float], tool_in_flange: Transform | None = None) -> Transform:
        return compose(self.model.flange(joints), tool_in_flange or self.tool_in_flange)

    def tcp_frame(self, joints: Sequence[float]) -> Frame:
        return Frame.from_transform(self.tcp(joints))


def worst_loads(robot: SteppedRobot) -> dict[str, float]:
    """Return the largest velocity, acceleration and jerk of any joint at any tick, as parts of the limits.

    They are found by differences. Stops have limits of their own, and so has direct mode."""
    limits = robot.description
    q = np.array([robot.joints[0]] * 3 + robot.joints + [robot.joints[-1]] * 3)
    stopping, direct = (
        np.array([False] * 3 + flags + [flags[-1]] * 3) for flags in (robot.stopping, robot.direct)
    )
    direct_limits = replace(limits, acceleration=limits.direct_acceleration, jerk=limits.direct_jerk)
    worst = {}
    for order, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
        # Of velocity there is one limit, in each mode and for stops, too.
        parts = ("", "stop_") if order > 1 else ("", "")
        bounds = np.array(
            [[getattr(each, part + name) for each in (limits, direct_limits)] for part in parts]
        )
        stopped, stiff = (
            np.lib.stride_tricks.sliding_window_view(flags, order + 1).any(axis=1)
            for flags in (stopping, direct)
        )
        differences = np.abs(np.diff(q, n=order, axis=0)) / robot.tick_s**order
        worst[name] = float((differences / bounds[stopped * 1, stiff * 1]).max())
    return worst


def assert_within_positions(limits: RobotDescription, joints: Sequence[Sequence[float]] | Array) -> None:
    """No joint is beyond a position limit."""
    q = np.array(joints)
    assert (q >= np.array(limits.position_min) - ROUNDING).all(), "beyond a position limit"
    assert (q <= np.array(limits.position_max) + ROUNDING).all(), "beyond a position limit"


def assert_within_limits(robot: SteppedRobot) -> None:
    """At no tick is any joint beyond a limit of position, velocity, acceleration or jerk."""
    assert_within_positions(robot.description, robot.joints)
    assert_loads_are_within(worst_loads(robot))


def assert_loads_are_within(worst: dict[str, float]) -> None:
    """Velocity, acceleration and jerk over their limits."""
    assert worst["velocity"] <= VELOCITY_TOLERANCE, worst
    assert worst["acceleration"] <= TOLERANCE, worst
    assert worst["jerk"] <= JERK_TOLERANCE, worst


def line_errors(robot: SteppedRobot, joints: Sequence[Sequence[float]], target: Frame) -> tuple[float, float]:
    """Return the greatest deviation of the TCP from the straight line to a target: m and rad.

    The expected orientation has the same part of the shortest arc as the position has of the line.
    """
    poses = [robot.tcp(q) for q in joints]
    p = np.array([pose.translation for pose in poses])
    r = np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3)
    end = target.to_transform()
    delta = np.array(end.translation) - p[0]
    length = float(np.linalg.norm(delta))
    along = (p - p[0]) @ delta / length**2
    off_line = np.linalg.norm(p - p[0] - along[:, None] * delta, axis=1)
    assert along.min() > -ROUNDING
    assert along.max() < 1.0 + ROUNDING
    turn = pin.log3(np.array(end.rotation).reshape(3, 3) @ r[0].T)
    expected = rotation_exp(along[:, None] * turn) @ r[0]
    off_arc = np.linalg.norm(expected - r, axis=(1, 2)) / np.sqrt(2.0)
    return float(off_line.max()), float(off_arc.max())


def assert_straight(robot: SteppedRobot, joints: Sequence[Sequence[float]], target: Frame) -> None:
    """The TCP is on the line at every tick, to 1 um and 1e-6 rad, and at its end after the last."""
    off_line_m, off_arc_rad = line_errors(robot, joints, target)
    assert off_line_m < 1e-6
    assert off_arc_rad < 1e-6
    missing = np.subtract(robot.tcp(joints[-1]).translation, target.to_transform().translation)
    assert np.linalg.norm(missing) < 1e-9


def rotation_exp(vectors: Array) -> Array:
    """Return rotation matrices (m, 3, 3) of rotation vectors (m, 3)."""
    return np.array([pin.exp3(vector) for vector in vectors])
