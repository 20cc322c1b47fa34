"""The TCP at a velocity that is told again and again, on the stepped core."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.arm.arm import LocalArm
from iiwa_sim.ros.arm.joint_level import TWIST as TOPIC
from iiwa_sim.ros.arm.joint_level import JointLevel
from iiwa_sim.ros.arm.links import Links
from tests.ros_robot import NOW_NS, RosRobot
from tests.samples import some

Place = NDArray[np.float64]


def twist(frame_id: str = "", **parts: float) -> dict[str, Any]:
    """geometry_msgs/TwistStamped; parts are vx, wz and so on (m/s, rad/s)."""
    linear, angular = ({axis: parts.get(f"{kind}{axis}", 0.0) for axis in "xyz"} for kind in "vw")
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame_id},
        "twist": {"linear": linear, "angular": angular},
    }


class Servoed(RosRobot):
    """A robot whose stamps are of simulated time, so that a twist becomes stale by it."""

    def __init__(self) -> None:
        super().__init__()
        rate_hz = round(1.0 / self.tick_s)
        self.level = JointLevel(LocalArm(self.controller), self._now_ns, rate_hz, self.log)

    def _now_ns(self) -> int:
        return NOW_NS + round(1e9 * self.controller.tick * self.tick_s)

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            super().step()
            self.level.step()

    def follows(self, told: dict[str, Any], seconds: float) -> tuple[Place, Place]:
        """Where the TCP is before and after, in base axes (m), while the twist comes 50 times a second."""
        before = np.array(self.controller.tool_frame()[:3])
        for tick in range(round(seconds / self.tick_s)):
            if tick % 10 == 0:
                self.level.receive(TOPIC, told, "test")
            self.step()
        return 1e-3 * before, 1e-3 * np.array(self.controller.tool_frame()[:3])


@pytest.fixture
def servoed() -> Servoed:
    return Servoed()


@pytest.mark.parametrize("frame_id", ["", "base_link"])
def test_a_twist_moves_the_tcp_at_its_velocity_and_a_stale_one_lets_it_rest(
    servoed: Servoed, frame_id: str
) -> None:
    robot = servoed
    told = twist(frame_id or "", vx=0.02, vz=-0.05)
    if frame_id:
        told["header"]["frame_id"] = Links(robot.description.urdf, robot.description.joints).base
    robot.follows(told, 0.5)
    start, end = robot.follows(told, 1.0)
    assert end - start == pytest.approx([0.02, 0.0, -0.05], abs=1e-3), "m in a second, once it is at speed"
    robot.step(round(0.5 / robot.tick_s))
    assert not robot.controller.moving
    assert not robot.level._twist.active


def test_a_twist_in_the_tools_axes_goes_along_them_and_turns_about_them(servoed: Servoed) -> None:
    robot = servoed
    tool = np.array(robot.controller.tool_frame().to_transform().rotation).reshape(3, 3)
    robot.follows(twist("tool", vz=0.05), 0.5)
    start, end = robot.follows(twist("tool", vz=0.05), 1.0)
    assert end - start == pytest.approx(0.05 * tool[:, 2], abs=1e-3)
    robot.step(round(0.5 / robot.tick_s))
    before = np.array(robot.controller.tool_frame().to_transform().rotation).reshape(3, 3)
    start, end = robot.follows(twist("tool", wx=0.3), 1.5)
    robot.step(round(0.5 / robot.tick_s))
    after = np.array(robot.controller.tool_frame().to_transform().rotation).reshape(3, 3)
    turn = before.T @ after
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    assert axis / np.linalg.norm(axis) == pytest.approx([1.0, 0.0, 0.0], abs=0.03)
    assert np.linalg.norm(end - start) < 5e-3, "the TCP stays"


@given(numbers=st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6), of_tool=st.booleans())
@settings(max_examples=some(30), deadline=None)
def test_any_twist_keeps_the_robots_limits_and_comes_to_rest(numbers: list[float], of_tool: bool) -> None:
    robot = Servoed()
    names = ("vx", "vy", "vz", "wx", "wy", "wz")
    told = twist("tool" if of_tool else "", **dict(zip(names, numbers, strict=True)))
    joints = [robot.controller.joints]
    for tick in range(round(1.5 / robot.tick_s)):
        if tick % 10 == 0 and tick < 400:
            robot.level.receive(TOPIC, told, "test")
        robot.step()
        joints.append(robot.controller.joints)
    assert not robot.controller.moving
    description = robot.description
    fastest = np.abs(np.diff(joints, axis=0)).max(axis=0) / robot.tick_s
    assert (fastest <= np.array(description.velocity) * 1.001).all()
    assert (np.array(joints) >= np.array(description.position_min) - 1e-9).all()
    assert (np.array(joints) <= np.array(description.position_max) + 1e-9).all()


def test_a_twist_that_is_none_is_refused_and_nothing_moves(servoed: Servoed) -> None:
    robot, topic = servoed, TOPIC
    for told, reason in (
        (twist("elbow", vx=0.1), "frame_id 'elbow'"),
        (twist(vx=float("nan")), "not finite"),
        ({**twist(vx=0.1), "header": {"stamp": {"sec": 5, "nanosec": 0}, "frame_id": ""}}, "s old"),
    ):
        with pytest.raises(Refused, match=reason):
            robot.level.receive(topic, told, "test")
    robot.step(100)
    assert not robot.controller.moving
    robot.controller.emergency_stop()
    robot.level.receive(topic, twist(vx=0.1), "test")
    robot.step(100)
    assert not robot.level._twist.active, "it is dropped: a robot that is reset does not set out by itself"
    assert [code for _, line, code, _ in robot.log.refusals if line == TOPIC] == [3030]
