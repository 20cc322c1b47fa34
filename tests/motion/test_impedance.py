"""How the TCP yields: deflection, damping, stability, and what happens at limits; springs and bounds."""

from __future__ import annotations

from math import exp, hypot, pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.contact import shapes
from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.frames import Transform, Vector, multiply, rotate, rotation_vector, transpose, with_z_along
from iiwa_sim.motion.impedance_kernel import JointBounds, TcpSprings
from iiwa_sim.motion.springs import (
    LEAST_DAMPING_NS_PER_M,
    MASS_KG,
    ROTATIONAL_STIFFNESS_NM_PER_RAD,
    CartesianImpedance,
    damping,
    least_deviation,
    spring,
)
from iiwa_sim.robot.arm_kernel import Kinematics
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model


class Plane(TcpContact):  # type: ignore[misc]  # mypy knows no compiled class
    """Half a space of stiffness k (N/m) and damping b (s/m), without friction; the TCP is a point."""

    def __init__(
        self, stiffness: float, point: Vector, normal: Vector = (0.0, 0.0, 1.0), damping: float = 0.0
    ) -> None:
        self.stiffness = stiffness
        self._point = np.array(point)
        self._normal = np.array(normal) / np.linalg.norm(normal)
        self.deepest_m = 0.0
        pose = Transform(with_z_along(tuple(self._normal.tolist())), point)
        super().__init__([Surface("plane", shapes.Plane(), pose, stiffness, damping, 0.0)], 0.0)

    def depth(self, position: Vector) -> float:
        return max(float((self._point - np.array(position)) @ self._normal), 0.0)

    def acts_at(
        self, px: float, py: float, pz: float, vx: float, vy: float, vz: float, remember: bool, acting: Any
    ) -> bool:
        if remember:
            self.deepest_m = max(self.deepest_m, self.depth((px, py, pz)))
        acts: bool = super().acts_at(px, py, pz, vx, vy, vz, remember, acting)
        return acts


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
NUMBERS = st.floats(-1.0, 1.0)
TICKS_AND_STIFFNESSES = [(0.002, 5000.0), (0.01, 100.0)]


def joint_bounds(d: RobotDescription, tick_s: float) -> JointBounds:
    return JointBounds(tick_s, d.position_min, d.position_max, d.velocity, d.stop_acceleration, d.stop_jerk)


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
        self.load = ExternalWrench(arm.model, d.tool_in_flange, joints)
        self.tick_s = tick_s
        self.kinematics = arm.kinematics
        bounds = joint_bounds(d, tick_s)
        self.compliance = TcpSprings(arm.kinematics, bounds, tick_s, self.load.pushes, plane)
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


@pytest.mark.parametrize("a6", [5.0])
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


@given(
    arm=st.sampled_from([ARM, SIX_AXES]),
    tick_s=st.sampled_from([0.001, 0.002, 0.01]),
    parts=st.tuples(*[st.floats(0.0, 1.0)] * 7),
    wanted=st.lists(st.tuples(*[st.floats(-0.2, 0.2)] * 7), min_size=1, max_size=6),
)
def test_joints_that_keep_the_bounds_can_brake_before_their_limits_at_any_tick(
    arm: Arm, tick_s: float, parts: tuple[float, ...], wanted: list[tuple[float, ...]]
) -> None:
    d, bounds = arm.description, joint_bounds(arm.description, tick_s)
    low, high = np.array(d.position_min), np.array(d.position_max)
    acceleration, jerk = np.array(d.stop_acceleration), np.array(d.stop_jerk)
    joints = np.clip(low + np.array(parts[: len(low)]) * (high - low), low, high)
    for every in wanted:
        for _ in range(40):
            least, greatest = bounds.ranges(tuple(joints.tolist()))
            motion = np.clip(every[: len(low)], least, greatest)
            a_hair_less = np.sign(motion) * np.maximum(np.abs(motion) - 1e-12, 0.0)
            assert bounds.allow(tuple(joints.tolist()), tuple((joints + a_hair_less).tolist()))
            joints = joints + motion
            speed = np.abs(motion) / tick_s
            assert (speed <= np.array(d.velocity) * (1 + 1e-12)).all()
            # With full jerk and full acceleration, or with full jerk alone where that is enough.
            braking = np.where(
                speed * jerk >= acceleration**2,
                0.5 * speed * (speed / acceleration + acceleration / jerk),
                speed * np.sqrt(speed / jerk),
            )
            room = np.where(motion > 0.0, high - joints, joints - low)
            assert (braking <= room + 1e-9).all()


def test_motion_beyond_the_bounds_is_not_allowed() -> None:
    bounds, here = joint_bounds(ROBOT, 0.002), ROBOT.home
    for sign in (1.0, -1.0):
        fast = (here[0] + sign * 0.002 * ROBOT.velocity[0] * 1.01, *here[1:])
        assert not bounds.allow(here, fast)
        near = (sign * (ROBOT.position_max[0] - 1e-3), *here[1:])
        assert not bounds.allow(near, (near[0] + sign * 0.9e-3, *here[1:]))
        assert bounds.allow(near, (near[0] - sign * 3e-3, *here[1:])), "away from the limit at full speed"


@given(
    mass=st.floats(0.1, 10.0),
    stiffness=st.floats(0.0, 5000.0),
    least=st.floats(0.0, 50.0),
    x=st.floats(-1.0, 1.0),
    v=st.floats(-2.0, 2.0),
    f=st.floats(-100.0, 100.0),
    step_s=st.sampled_from([0.0005, 0.002, 0.01]),
)
def test_one_step_is_as_good_as_many(
    mass: float, stiffness: float, least: float, x: float, v: float, f: float, step_s: float
) -> None:
    damped = damping(mass, stiffness, least)
    once = spring(mass, stiffness, damped, step_s).reshape(2, 3) @ [x, v, f]
    # Fourth order Runge-Kutta, in small steps.
    h, (y, u) = step_s / 200, (x, v)
    for _ in range(200):

        def rate(y: float, u: float) -> tuple[float, float]:
            return u, (f - damped * u - stiffness * y) / mass

        a = rate(y, u)
        b = rate(y + h / 2 * a[0], u + h / 2 * a[1])
        c = rate(y + h / 2 * b[0], u + h / 2 * b[1])
        d = rate(y + h * c[0], u + h * c[1])
        y += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        u += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
    assert tuple(once) == pytest.approx((y, u), rel=1e-6, abs=1e-8)


def test_damping_has_the_ratio_and_a_least_value() -> None:
    assert damping(5.0, 2000.0) == pytest.approx(2 * 0.7 * (5.0 * 2000.0) ** 0.5)
    assert damping(5.0, 0.0, 20.0) == 20.0


@given(
    matrix=st.lists(st.tuples(*[NUMBERS] * 4), min_size=3, max_size=3),
    wanted=st.tuples(*[NUMBERS] * 3),
    bounds=st.tuples(*[st.tuples(NUMBERS, st.floats(0.0, 0.5))] * 4),
)
def test_it_stays_within_bounds(
    matrix: list[tuple[float, ...]], wanted: tuple[float, ...], bounds: tuple[tuple[float, float], ...]
) -> None:
    least, greatest = [a for a, _ in bounds], [a + width for a, width in bounds]
    way = least_deviation(np.array(matrix), np.array(wanted), 1e-4, least, greatest)
    assert all(a - 1e-12 <= w <= b + 1e-12 for w, a, b in zip(way, least, greatest, strict=True))


def test_without_bounds_it_does_what_is_wanted_and_the_others_make_up_for_a_joint_at_its_bound() -> None:
    jacobian = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
    free = least_deviation(jacobian, np.array([1.0, 1.0]), 1e-9, [-9.0] * 3, [9.0] * 3)
    assert free == pytest.approx([0.5, 0.5, 0.5], abs=1e-6)
    held = least_deviation(jacobian, np.array([1.0, 1.0]), 1e-9, [-9.0] * 3, [0.1, 9.0, 9.0])
    assert held == pytest.approx([0.1, 0.9, 0.5], abs=1e-6)


def test_a_singular_direction_is_left_alone() -> None:
    jacobian = np.array([[1.0, 0.0], [0.0, 1e-6]])
    way = least_deviation(jacobian, np.array([0.0, 1e-3]), 1e-4, [-9.0] * 2, [9.0] * 2)
    assert np.abs(way).max() < 1e-4
