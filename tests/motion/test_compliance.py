"""How the TCP yields: deflection, damping, stability, and what happens at limits."""

from __future__ import annotations

from math import exp, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.frames import Vector, multiply, rotate, rotation_vector, transpose
from iiwa_sim.motion.compliance_kernel import (
    ROTATIONAL_STIFFNESS_NM_PER_RAD,
    CartesianImpedance,
    Compliance,
)
from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.shift_kernel import LEAST_DAMPING_NS_PER_M, MASS_KG
from iiwa_sim.robot.arm_kernel import Kinematics
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.feeling_kernel import Feeling
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model


class Plane(Feeling):  # type: ignore[misc]  # mypy knows no compiled class
    """Half a space: stiffness k (N/m) and, as b k d d', damping b (s/m), without friction. It never pulls."""

    def __init__(
        self, stiffness: float, point: Vector, normal: Vector = (0.0, 0.0, 1.0), damping: float = 0.0
    ) -> None:
        self.stiffness = stiffness
        self.damping = damping
        self._point = np.array(point)
        self._normal = np.array(normal) / np.linalg.norm(normal)
        self.deepest_m = 0.0

    def depth(self, position: Vector) -> float:
        return max(float((self._point - np.array(position)) @ self._normal), 0.0)

    def feel_at(
        self, px: float, py: float, pz: float, vx: float, vy: float, vz: float, remember: bool
    ) -> bool:
        depth = self.depth((px, py, pz))
        if depth == 0.0:
            return False
        if remember:
            self.deepest_m = max(self.deepest_m, depth)
        damped = max(1.0 - self.damping * float(np.array((vx, vy, vz)) @ self._normal), 0.0)
        self.fx, self.fy, self.fz = (self.stiffness * depth * damped * self._normal).tolist()
        return True


class Arm:
    """A robot with its own tool."""

    def __init__(self, name: str) -> None:
        self.description = load_robot(name)
        self.model = Model(self.description)
        self.kinematics = Kinematics(self.model, Inverse(self.model), self.description.tool_in_flange)


ARM, SIX_AXES = Arm("lbr_iiwa_7_r800"), Arm("kr_6_r900_sixx")
ROBOT, KINEMATICS = ARM.description, ARM.kinematics
POSE = (0.3, 0.6, -0.2, -1.3, 0.3, 0.9, -0.5)
POSES = {ARM: POSE, SIX_AXES: (0.3, -1.2, 1.4, 0.2, 0.9, -0.5)}
both = pytest.mark.parametrize("arm", POSES, ids=lambda arm: arm.description.name)
NO_FORCE = (0.0,) * 6
TICKS_AND_STIFFNESSES = [(0.002, 5000.0), (0.01, 100.0)]


class Yielding:
    """A robot that yields around a pose that stays."""

    def __init__(
        self,
        tick_s: float,
        plane: Plane | None = None,
        joints: tuple[float, ...] | None = None,
        arm: Arm = ARM,
    ) -> None:
        """At the arm's own of POSES if no joints are named."""
        d = arm.description
        joints = POSES[arm] if joints is None else joints
        self.load = ExternalLoad(arm.model, d.tool_in_flange, joints)
        self.tick_s = tick_s
        self.kinematics = arm.kinematics
        bounds = JointBounds(
            tick_s, d.position_min, d.position_max, d.velocity, d.stop_acceleration, d.stop_jerk
        )
        self.compliance = Compliance(arm.kinematics, bounds, tick_s, self.load, plane)
        self.compliance.start(joints)
        self.nominal = self.joints = joints

    def step(self, stiffness: float, control: tuple[float, ...] = NO_FORCE) -> tuple[float, ...]:
        self.joints = self.compliance.step(self.nominal, CartesianImpedance(stiffness, control))
        return self.joints

    def runs(self, stiffness: float, seconds: float) -> np.ndarray:
        """How far the TCP is off the plan at every tick: m and rad, in the base."""
        return np.array([self.off(self.step(stiffness)) for _ in range(round(seconds / self.tick_s))])

    def off(self, joints: tuple[float, ...]) -> list[float]:
        pose, plan = self.kinematics.tcp(joints), self.kinematics.tcp(self.nominal)
        axis, angle = rotation_vector(multiply(pose.rotation, transpose(plan.rotation)))
        way = np.subtract(pose.translation, plan.translation)
        return [*way, *(angle * np.array(axis))]


def push_along(force: tuple[float, float, float], arm: Arm = ARM) -> tuple[float, ...]:
    """A force in the base as a wrench in the axes that the TCP has in the arm's own of POSES."""
    return (*rotate(transpose(arm.kinematics.tcp(POSES[arm]).rotation), force), 0.0, 0.0, 0.0)


@pytest.mark.parametrize(("tick_s", "stiffness"), TICKS_AND_STIFFNESSES)
@both
def test_a_push_deflects_by_force_over_stiffness_and_its_end_brings_the_robot_home(
    arm: Arm, tick_s: float, stiffness: float
) -> None:
    robot = Yielding(tick_s, arm=arm)
    force = (0.01 * stiffness, -0.008 * stiffness, 0.005 * stiffness)
    robot.load.wrench = push_along(force, arm)
    off = robot.runs(stiffness, 5.0)[-1]
    np.testing.assert_allclose(off[:3], np.array(force) / stiffness, rtol=1e-6)
    np.testing.assert_allclose(off[3:], 0.0, atol=1e-8)
    robot.load.wrench = NO_FORCE
    robot.runs(stiffness, 8.0)
    assert robot.joints == POSES[arm], "exactly"
    assert robot.compliance.on_plan


@pytest.mark.parametrize("a6", [0.5, -3.5, 5.0])
def test_an_arm_without_redundancy_yields_too_also_with_a_joint_beyond_half_a_turn(a6: float) -> None:
    pose = (0.3, -1.2, 1.4, 0.2, 0.9, a6)
    robot = Yielding(0.002, joints=pose, arm=SIX_AXES)
    force = (20.0, -16.0, 10.0)
    axes = transpose(SIX_AXES.kinematics.tcp(pose).rotation)
    robot.load.wrench = (*rotate(axes, force), 0.0, 0.0, 0.0)
    off = robot.runs(2000.0, 5.0)[-1]
    np.testing.assert_allclose(off[:3], np.array(force) / 2000.0, rtol=1e-6)
    np.testing.assert_allclose(off[3:], 0.0, atol=1e-8)
    assert abs(robot.joints[5] - a6) < 0.2
    robot.load.wrench = NO_FORCE
    robot.runs(2000.0, 8.0)
    assert robot.joints == pose, "exactly"


@pytest.mark.parametrize("tick_s", [0.01])
@both
def test_a_torque_deflects_by_torque_over_stiffness(arm: Arm, tick_s: float) -> None:
    robot = Yielding(tick_s, arm=arm)
    robot.load.wrench = (0.0, 0.0, 0.0, 0.0, 10.0, 0.0)
    off = robot.runs(2000.0, 3.0)[-1]
    axis = rotate(arm.kinematics.tcp(POSES[arm]).rotation, (0.0, 1.0, 0.0))
    np.testing.assert_allclose(off[3:], np.array(axis) * 10.0 / ROTATIONAL_STIFFNESS_NM_PER_RAD, atol=1e-6)
    np.testing.assert_allclose(off[:3], 0.0, atol=1e-8)


@pytest.mark.parametrize(("tick_s", "stiffness"), TICKS_AND_STIFFNESSES)
@both
def test_a_step_of_the_force_overshoots_and_settles_as_a_damping_ratio_of_0_7_does(
    arm: Arm, tick_s: float, stiffness: float
) -> None:
    robot = Yielding(tick_s, arm=arm)
    robot.load.wrench = push_along((0.0, 0.005 * stiffness, 0.0), arm)
    y = robot.runs(stiffness, 3.0)[:, 1] / 0.005
    frequency = sqrt(stiffness / MASS_KG)
    damped = frequency * sqrt(1.0 - 0.7**2)
    t = tick_s * np.arange(1, len(y) + 1)
    exact = 1.0 - np.exp(-0.7 * frequency * t) * (
        np.cos(damped * t) + 0.7 * frequency / damped * np.sin(damped * t)
    )
    np.testing.assert_allclose(y, exact, atol=1e-6)
    overshoot = exp(-pi * 0.7 / sqrt(1.0 - 0.7**2))
    assert y.max() - 1.0 == pytest.approx(overshoot, rel=0.1)
    late = t > 5.0 / (0.7 * frequency)
    assert np.abs(y[late] - 1.0).max() < 0.01


@both
def test_without_a_spring_the_robot_drifts_and_is_damped(arm: Arm) -> None:
    robot = Yielding(0.002, arm=arm)
    robot.load.wrench = push_along((0.0, 4.0, 0.0), arm)
    y = robot.runs(0.0, 1.0)[:, 1]
    assert (y[-1] - y[-2]) / 0.002 == pytest.approx(4.0 / LEAST_DAMPING_NS_PER_M, rel=0.05)
    robot.load.wrench = NO_FORCE
    y = robot.runs(0.0, 4.0)[:, 1]
    assert abs(y[-1] - y[-2]) < 1e-9
    assert y[-1] > 0.15, "nothing brings it back"


@pytest.mark.parametrize(
    ("tick_s", "surface", "arm", "stiffness"),
    [(0.01, 1e3, ARM, 0.0), (0.002, 1e5, ARM, 5000.0), (0.01, 1e4, SIX_AXES, 2000.0)],
)
def test_pressed_on_a_surface_it_comes_to_rest_where_the_forces_balance(
    arm: Arm, tick_s: float, surface: float, stiffness: float
) -> None:
    x, y, z = arm.kinematics.tcp(POSES[arm]).translation
    plane = Plane(surface, (x, y, z + 0.01), damping=1.0)
    robot = Yielding(tick_s, plane, arm=arm)  # begins 10 mm inside
    robot.load.wrench = push_along((0.0, 0.0, -20.0), arm)
    # Without a spring it takes its damping longer.
    ends = robot.runs(stiffness, 12.0 if stiffness < 100.0 else 6.0)[-round(0.1 / tick_s) :, 2]
    assert np.ptp(ends) < 1e-6, "at rest"
    balanced = (0.01 * surface - 20.0) / (surface + stiffness)
    depth = 0.01 - balanced
    assert 0.01 - ends[-1] == pytest.approx(depth, rel=0.01)


@pytest.mark.parametrize(
    ("tick_s", "arm", "stiffness", "surface", "damping"),
    [(0.01, ARM, 0.0, 1e3, 2.0), (0.002, ARM, 5000.0, 1e5, 0.0), (0.01, SIX_AXES, 2000.0, 1e4, 2.0)],
)
def test_energy_never_grows_in_contact(
    arm: Arm, tick_s: float, surface: float, stiffness: float, damping: float
) -> None:
    pose = arm.kinematics.tcp(POSES[arm]).translation
    plane = Plane(surface, pose, damping=damping)
    robot = Yielding(tick_s, plane, arm=arm)
    robot.load.wrench = push_along((0.0, 0.0, 40.0), arm)
    robot.runs(stiffness, 0.3)
    robot.load.wrench = NO_FORCE

    def energy() -> float:
        x, v = robot.compliance.deflection, robot.compliance.velocity
        kinetic = 0.5 * MASS_KG * sum(u * u for u in v[:3])
        depth = plane.depth((pose[0] + x[0], pose[1] + x[1], pose[2] + x[2]))
        return kinetic + 0.5 * stiffness * hypot(*x[:3]) ** 2 + 0.5 * surface * depth**2

    energies = [energy()]
    for _ in range(round(1.5 / tick_s)):
        robot.step(stiffness)
        energies.append(energy())
    assert energies[0] > 0.0
    growth = np.diff(energies)
    assert growth.max() <= 1e-3 * energies[0]
    assert energies[-1] < 0.3 * energies[0]


# Limits


@st.composite
def pushed(draw: st.DrawFn) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    force = st.floats(-3000.0, 3000.0)
    kick = st.tuples(st.tuples(*[force] * 6), st.tuples(*[st.floats(-300.0, 300.0)] * 7))
    return draw(st.lists(kick, min_size=1, max_size=4))


@given(
    arm=st.sampled_from([ARM, SIX_AXES]),
    pushes=pushed(),
    stiffness=st.sampled_from([0.0, 100.0, 5000.0]),
    tick_s=st.sampled_from([0.002, 0.01]),
    parts=st.tuples(*[st.floats(0.0, 1.0)] * 7),
)
def test_no_push_takes_a_joint_beyond_its_limits(
    arm: Arm,
    pushes: list[tuple[tuple[float, ...], tuple[float, ...]]],
    stiffness: float,
    tick_s: float,
    parts: tuple[float, ...],
) -> None:
    low, high = np.array(arm.description.position_min), np.array(arm.description.position_max)
    count = len(low)
    joints = tuple(np.clip(low + parts[:count] * (high - low), low, high).tolist())
    robot = Yielding(tick_s, joints=joints, arm=arm)
    places = [joints]
    for wrench, joint_push in pushes:
        robot.load.wrench, robot.load.joint_push = wrench, joint_push[:count]
        places += [robot.step(stiffness) for _ in range(round(0.15 / tick_s))]
    q = np.array(places)
    assert np.isfinite(q).all()
    assert (q >= low).all()
    assert (q <= high).all()
    assert (np.abs(np.diff(q, axis=0)) <= np.array(arm.description.velocity) * tick_s * (1 + 1e-9)).all()


def test_beyond_its_reach_the_arm_is_stretched_and_comes_back() -> None:
    robot = Yielding(0.01)
    x, y, z = KINEMATICS.tcp(POSE).translation
    outwards = np.array([x, y, z - 0.34])
    force = 4000.0 * outwards / np.linalg.norm(outwards)
    robot.load.wrench = push_along(tuple(force))
    robot.runs(2000.0, 4.0)
    assert abs(robot.joints[3]) < 0.25, "nearly stretched"
    robot.load.wrench = NO_FORCE
    assert np.abs(robot.runs(2000.0, 6.0)[-1]).max() < 1e-4
    np.testing.assert_allclose(robot.joints, POSE, atol=1e-3)
