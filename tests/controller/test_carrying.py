"""Carried loads, and the load that is set in the controller."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from iiwa_sim.cell.cell import Cell, shared_world
from iiwa_sim.controller.carrying import NO_TOOL, Inertia, Tool, ToolLoad
from iiwa_sim.controller.limits_watch import Safety
from iiwa_sim.frames import Frame, compose, rotate
from tests.requests import joint_move, lin_stiff_move
from tests.stepped import ARMS, SteppedRobot, strong

GRAVITY = 9.81
INERTIA: Inertia = (0.01, 0.012, 0.008, 0.001, -0.002, 0.0005)
TOOL = Tool(ToolLoad(2.0, (0.02, -0.03, 0.09)), INERTIA)
TICK_S = 0.002


def carrying(name: str = ARMS[0], tool: Tool = TOOL, **safety: float) -> SteppedRobot:
    """At home with a tool, on joints that no force stops."""
    description = strong(name)
    cell = Cell(description, description.home, description.tool_in_flange, tool=tool, safety=Safety(**safety))
    return SteppedRobot(cell=cell)


class CarriedBody:
    """A body on the flange of a massless arm, as Pinocchio has it."""

    def __init__(self, robot: SteppedRobot) -> None:
        description = robot.description
        self._model = pin.buildModelFromXML(description.urdf)
        for inertia in self._model.inertias:
            inertia.setZero()
        self._flange = self._model.frames[self._model.getFrameId(description.flange)]
        ixx, iyy, izz, ixy, ixz, iyz = INERTIA
        matrix = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        body = pin.Inertia(TOOL.load.mass_kg, np.array(TOOL.load.centre), matrix)
        self._model.appendBodyToJoint(self._flange.parentJoint, body, self._flange.placement)
        self._data = self._model.createData()
        rotation, place = description.tool_in_flange
        self._tcp = pin.SE3(np.array(rotation).reshape(3, 3), np.array(place))

    def acts(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By Newton and Euler: the wrench at the TCP along its axes, and the torques on the joints."""
        torques = -pin.rnea(self._model, self._data, q, v, a)
        at_joint = -self._data.f[self._flange.parentJoint]
        return (self._flange.placement * self._tcp).inverse().act(at_joint).vector, torques


@pytest.mark.parametrize("name", ARMS)
def test_an_unknown_tool_acts_by_newton_and_euler(name: str) -> None:
    """Its weight at random poses, and on a move to 1 % of the greatest wrench, in the same tick."""
    robot = carrying(name)
    controller, d = robot.controller, robot.description
    controller.set_tool_load(NO_TOOL.load)
    reference, still = CarriedBody(robot), np.zeros(len(d.joints))
    rng = np.random.default_rng(4)
    for q in rng.uniform(d.position_min, d.position_max, (20, len(still))):
        controller.place(q.tolist())
        wrench, torques = reference.acts(q, still, still)
        assert np.abs(controller.cartesian_force() - wrench).max() <= 1e-6
        assert np.abs(controller.joint_torque() - torques).max() <= 1e-6
        controller.step()
        assert np.abs(controller.cartesian_force() - wrench).max() <= 1e-6
    robot.joints = [controller.joints]
    felt = [controller.cartesian_force()]
    controller.move(joint_move(d.home, [1.0] * len(d.home)))
    while controller.moving:
        robot.step()
        felt.append(controller.cartesian_force())
    q = np.array(robot.joints)
    v, a = (q[2:] - q[:-2]) / (2 * TICK_S), (q[2:] - 2 * q[1:-1] + q[:-2]) / TICK_S**2
    expected = np.array([reference.acts(*each)[0] for each in zip(q[1:-1], v, a, strict=True)])
    off = np.abs(np.array(felt[1:-1]) - expected)
    for part in (slice(0, 3), slice(3, 6)):
        assert off[:, part].max() <= 0.01 * np.linalg.norm(expected[:, part], axis=1).max()


def test_weight_acts_down_in_the_world_also_on_a_robot_on_a_wall() -> None:
    d = strong(ARMS[0])
    upright = Cell(d, d.home, d.tool_in_flange, name="upright")
    on_wall = Cell(
        d, d.home, d.tool_in_flange, tool=TOOL, name="wall", base=Frame(0, 3000, 900, 0, 1, 1).to_transform()
    )
    world = shared_world([upright, on_wall], TICK_S)
    assert world is not None
    controller = on_wall.controller(TICK_S, arm=world.arms[1])
    controller.set_tool_load(NO_TOOL.load)
    tcp = compose(on_wall.base, controller.load.tcp(controller.joints))
    force = rotate(tcp.rotation, controller.cartesian_force()[:3])
    assert force == pytest.approx((0.0, 0.0, -GRAVITY * TOOL.load.mass_kg), abs=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_a_correct_load_has_no_external_wrench_and_stops_no_motion(name: str) -> None:
    """The motion is bit for bit that of an arm without a tool, also with the least thresholds."""
    robot, bare = carrying(name, force_n=0.1, torque_nm=0.1), carrying(name, NO_TOOL)
    rng, d = np.random.default_rng(9), robot.description
    for _ in range(2):
        target = rng.uniform(d.position_min, d.position_max).tolist()
        for each in (robot, bare):
            each.controller.move(joint_move(target, [1.0] * len(target)))
            each.runs_until_stopped()
        assert robot.controller.cartesian_force() == (0.0,) * 6
        assert robot.controller.joint_torque() == bare.controller.joint_torque()  # of links in each other
    assert robot.faults == []
    assert robot.joints == bare.joints
    assert robot.controller.load.is_idle(robot.controller.joints, robot.controller.tick, TICK_S)


def test_a_tcp_on_springs_sags_by_weight_over_stiffness() -> None:
    robot = carrying(tool=Tool(ToolLoad(2.0, strong(ARMS[0]).tool_in_flange.translation), (0.0,) * 6))
    here = robot.controller.tool_frame()
    robot.controller.set_tool_load(NO_TOOL.load)
    robot.controller.move(lin_stiff_move(here, 0.5, 1000.0, (0.0,) * 6))
    start = robot.tcp(robot.controller.joints).translation[2]
    robot.step(1500)
    sag = start - robot.tcp(robot.controller.joints).translation[2]
    assert sag == pytest.approx(2.0 * GRAVITY / 1000.0, rel=1e-3)
