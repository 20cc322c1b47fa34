"""Moves with a speed, an acceleration or a blend of their own: as asked, within the robot's limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.frames import Frame
from tests.requests import joint_move, lin_move, lin_move_at, ptp_move, smart_joint_move
from tests.stepped import ARMS, TOLERANCE, SteppedRobot, assert_within_limits

Array = NDArray[np.float64]
NEAR = 0.9
"""Part of a limit that a long move reaches: it is not kept by mere slowness."""


class Robot(SteppedRobot):
    """A robot with two targets that a PTP and a LIN both reach."""

    def __init__(self, arm: str) -> None:
        super().__init__(arm)
        self.home = self.controller.joints
        x, y, z, *angles = self.tcp_frame(self.home)
        self.aside = Frame(x, y + 150.0, z - 40.0, *angles)
        self.farther = Frame(x - 80.0, y + 150.0, z - 60.0, *angles)

    def moves(self, kind: str, speed_rel: float = 1.0, **caps: Any) -> None:
        controller = self.controller
        if kind == "joint":
            joints = [q + 0.4 for q in self.home]
            controller.move(joint_move(joints, [speed_rel] * len(joints), 0.0, **caps))
        elif kind == "ptp":
            controller.move(ptp_move(self.aside, speed_rel, 0.0, **caps))
        elif kind == "smart":
            joints = [q + 0.4 for q in self.home]
            controller.move(smart_joint_move(joints, [speed_rel] * len(joints), **caps))
        else:
            controller.move(lin_move(self.aside, speed_rel, 0.0, **caps))
        self.runs_until_stopped()

    def accelerations(self) -> Array:
        """Return the accelerations of the joints at every tick (m, n), in rad/s^2."""
        q = np.array([self.joints[0]] * 2 + self.joints + [self.joints[-1]] * 2)
        accelerations: Array = np.abs(np.diff(q, n=2, axis=0)) / self.tick_s**2
        return accelerations

    def tcp_accelerations(self) -> Array:
        """Return the acceleration of the TCP at every tick (m,), in m/s^2."""
        places = np.array([self.tcp(q).translation for q in self.joints])
        accelerations: Array = np.linalg.norm(np.diff(places, n=2, axis=0), axis=1) / self.tick_s**2
        return accelerations


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("kind", ["joint", "ptp", "lin", "smart"])
@given(share=st.floats(0.05, 1.0))
def test_joints_keep_the_requested_acceleration(arm: str, kind: str, share: float) -> None:
    robot = Robot(arm)
    robot.moves(kind, accelerations=(share,))
    used = (robot.accelerations() / robot.description.acceleration).max()
    assert used <= TOLERANCE * share
    assert used > NEAR * share if kind != "lin" else used > 0.5 * share
    assert_within_limits(robot)


@pytest.mark.parametrize("arm", ARMS)
@given(limit=st.floats(0.02, 20.0), speed_rel=st.floats(0.05, 1.0))
def test_an_acceleration_in_m_s2_is_that_of_the_tcp(arm: str, limit: float, speed_rel: float) -> None:
    robot = Robot(arm)
    robot.moves("lin", speed_rel, tcp_acceleration_m_s2=limit)
    assert robot.tcp_accelerations().max() <= TOLERANCE * limit
    assert_within_limits(robot)


def test_a_line_in_m_s_to_the_present_frame_ends_at_once() -> None:
    """It is so, too, where 32 bits have rounded the pose."""
    robot = Robot("lbr_iiwa_7_r800")
    here = robot.tcp_frame(robot.home)
    rounded = Frame(*(float(np.float32(value)) for value in here))
    for target in (here, rounded):
        robot.controller.move(lin_move_at(target, 0.1, 0.0))
        robot.runs_until_stopped()


@pytest.mark.parametrize("speed_m_s", [0.05, 0.4])
def test_the_tcp_on_a_line_reaches_its_speed_and_does_not_exceed_it(speed_m_s: float) -> None:
    robot = SteppedRobot()
    start = robot.controller.tool_frame()
    robot.controller.move(lin_move_at(start._replace(y_mm=start.y_mm + 250.0), speed_m_s, 0.0))
    robot.runs_until_stopped()
    places = np.array([robot.tcp(q).translation for q in robot.joints])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / robot.tick_s
    assert 0.9 * speed_m_s < speeds.max() <= speed_m_s * (1.0 + 1e-6)
