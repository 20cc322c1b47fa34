"""Robots whose links touch surfaces or each other."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import RobotEvent
from iiwa_sim.controller.errors import STOP_TRIGGERED, ErrorRecord
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.description import load_robot
from tests.contact.materials import at
from tests.requests import gravity_hold, joint_move
from tests.stepped import strong

TICK_S = 0.002
IIWA = "lbr_iiwa_7_r800"
STRETCHED: Joints = (0.0, 0.9, 0.0, -1.0, 0.0, 1.2, 0.0)
INTO_THE_WALL: Joints = (0.9, 0.9, 0.0, -1.0, 0.0, 1.2, 0.0)
WALL_Y = 0.45


def wall(stiffness: float = 50_000.0, y: float = WALL_Y, damping: float = 0.0) -> Surface:
    """Beside the arm: the TCP of a tool that points to the other side does not reach it."""
    return Surface("wall", Box(0.6, 0.4, 0.6), at(0.0, y + 0.4, 0.6), stiffness, damping, 0.3)


class Robot:
    """A robot among surfaces, with its events."""

    def __init__(self, *surfaces: Surface, start: Joints = STRETCHED, unbreakable: bool = False) -> None:
        self.faults: list[tuple[int, str]] = []
        self.events: list[str] = []
        self.controller = Controller(
            strong(IIWA) if unbreakable else load_robot(IIWA),
            TICK_S,
            start=start,
            contact=TcpContact(surfaces, 0.0),
            on_event=self._on_event,
        )

    def _on_event(self, event: RobotEvent) -> None:
        if isinstance(event, str):
            self.events.append(event)
        elif isinstance(event, ErrorRecord):
            self.faults.append((event.code, event.reason))

    def goes_to(self, joints: Joints, speed: float = 0.3) -> list[Joints]:
        """Return joint positions on the path to a target."""
        c = self.controller
        c.move(joint_move(joints, [speed] * 7))
        path = [c.joints]
        while c.moving:
            c.step()
            path.append(c.joints)
        return path


def test_a_link_that_meets_a_wall_stops_the_robot_by_the_torques_it_makes() -> None:
    robot = Robot(wall())
    c = robot.controller
    c.move(joint_move(INTO_THE_WALL, [0.3] * 7))
    while not c.load.link_contacts:
        assert set(c.joint_torque()) == {0.0}
        c.step()
    assert robot.events == [f"link {c.load.link_contacts[0].link} touches surface 'wall'"]
    assert c.joint_torque()[0] < 0.0, "it holds A1 back"
    assert c.cartesian_force() == (0.0,) * 6, "nothing touches the TCP"
    while not robot.faults:
        assert abs(c.joint_torque()[0]) <= 176.0
        c.step()
    code, reason = robot.faults[0]
    assert code == STOP_TRIGGERED
    assert reason.startswith("protective stop: the external torque on A")
    while c.moving:
        c.step()
    c.errors.reset()
    robot.goes_to(STRETCHED)
    assert len(robot.faults) == 1, "it may be led out"
    assert set(c.joint_torque()) == {0.0}
    assert c.load.link_contacts == ()


@pytest.mark.parametrize(("tick_s", "stiffness"), [(0.002, 2_000.0), (0.01, 1e7)])
def test_an_arm_in_a_hold_that_is_pushed_against_a_wall_comes_to_rest(
    tick_s: float, stiffness: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.controller.test_links.TICK_S", tick_s)
    robot = Robot(wall(stiffness), unbreakable=True)
    c = robot.controller
    c.move(gravity_hold(60.0))
    c.load.joint_push = (80.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    path = []
    for _ in range(round(2.5 / tick_s)):
        c.step()
        path.append(c.joints[0])
    late = np.array(path[-round(0.5 / tick_s) :])
    assert np.ptp(late) < 1e-6, "at rest"
    (contact, *_) = c.load.link_contacts
    assert contact.force[1] < 0.0
    # The push, the spring of the hold, and the wall are in balance about A1.
    assert c.joint_torque()[0] == pytest.approx(60.0 * (c.joints[0] - STRETCHED[0]), rel=1e-3)
    assert np.max(path) < c.joints[0] + 0.05, "it has not swung far into the wall"


FOLDED: Joints = (0.0, 2.09, 0.0, -2.09, 0.0, 0.0, 0.0)


def test_an_arm_that_folds_onto_itself_is_reported_once_and_stopped() -> None:
    robot = Robot()
    robot.goes_to(FOLDED, speed=0.5)
    folds = [event for event in robot.events if event.startswith("links iiwa_link_0 and iiwa_link_")]
    assert folds == robot.events
    assert len(robot.events) == 1
    (fault,) = robot.faults
    assert fault[0] == STOP_TRIGGERED
    assert "external torque" in fault[1]
    assert robot.controller.joints != FOLDED
    # Link 5 presses on the base: no torque on the joints behind it, and none after the robot has moved back.
    torques = robot.controller.joint_torque()
    assert torques[5:] == (0.0, 0.0)
    assert torques[3] != 0.0
    robot.controller.errors.reset()
    robot.goes_to(STRETCHED)
    assert set(robot.controller.joint_torque()) == {0.0}
    assert len(robot.faults) == 1
