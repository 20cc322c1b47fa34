"""External wrench on the arm, and its torques on the joints."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from tests.contact.materials import PLANE, RADIUS, STIFFNESS, World, at, surface
from tests.requests import lin_move
from tests.stepped import SteppedRobot

ROBOT = SteppedRobot()
TOOLS = [ROBOT.description.tool_in_flange, Frame(30.0, -20.0, 170.0, 0.4, -0.8, 1.2).to_transform()]
STEP = 1e-6
TICK_S = 0.002
TCP_HEIGHT = ROBOT.tcp(ROBOT.controller.joints).translation[2]


def test_pushes_add_up() -> None:
    controller = SteppedRobot().controller
    load = controller.load
    load.wrench = (0.0, 0.0, 10.0, 0.0, 0.0, 0.0)
    alone = controller.joint_torque()
    load.joint_push = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
    pushed = controller.joint_torque()
    np.testing.assert_allclose(np.subtract(pushed, alone), range(1, 8))
    assert controller.cartesian_force()[2] == 10.0


def pressed(depth: float, friction: float = 0.0, damping: float = 0.0) -> Controller:
    """At home, the contact sphere so deep (m) in a level surface."""
    table = surface(PLANE, at(0.0, 0.0, TCP_HEIGHT - RADIUS + depth), friction=friction, damping=damping)
    return Controller(load_robot(), TICK_S, contact=World([table], RADIUS))


def test_a_surface_acts_from_the_start_along_the_axes_of_the_tcp() -> None:
    controller = pressed(0.001)
    up = np.array([0.0, 0.0, STIFFNESS * 0.001])
    rotation = np.reshape(ROBOT.tcp(controller.joints).rotation, (3, 3))
    for _ in range(3):
        assert controller.cartesian_force()[:3] == pytest.approx(rotation.T @ up, abs=1e-9)
        assert controller.cartesian_force()[3:] == (0.0, 0.0, 0.0)
        lifting = ROBOT.model.tcp(TOOLS[0]).torques(controller.joints, controller.cartesian_force())
        assert controller.joint_torque() == lifting
        assert lifting[1] < -1.0, "what lifts the hand turns A2 backwards"
        controller.step()


def test_a_robot_that_has_slid_and_stands_keeps_its_friction() -> None:
    controller = pressed(0.001, friction=0.3, damping=0.5)
    target = controller.tool_frame()
    controller.move(lin_move(target._replace(y_mm=target.y_mm + 30.0), 0.5, 0.0))
    while controller.moving:
        controller.step()
    sliding = controller.cartesian_force()
    controller.step()
    kept = controller.cartesian_force()
    assert kept == pytest.approx(sliding)
    for _ in range(20):
        controller.step()
        assert controller.cartesian_force() == kept
    normal = STIFFNESS * 0.001
    assert np.linalg.norm(kept[:3]) == pytest.approx(normal * np.hypot(1.0, 0.3), rel=1e-6)
    assert np.linalg.norm(kept[3:]) == pytest.approx(RADIUS * 0.3 * normal, rel=1e-6)


def test_a_surface_put_under_a_robot_that_has_moved_pushes_by_its_depth() -> None:
    controller = Controller(load_robot(), TICK_S, contact=World([], RADIUS))
    start = controller.tool_frame()
    controller.move(lin_move(start._replace(z_mm=start.z_mm - 100.0), 0.5, 0.0))
    while controller.moving:
        controller.step()
    height = controller.tcp().translation[2]
    controller.load.contact.put(surface(PLANE, at(0.0, 0.0, height - RADIUS + 0.001), damping=1.0))
    controller.step()
    assert np.linalg.norm(controller.cartesian_force()) == pytest.approx(STIFFNESS * 0.001)
