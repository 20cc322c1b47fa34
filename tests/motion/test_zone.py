"""A corner stays in its zone and within position limits, and is as wide and as even as its turn wants it."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from iiwa_sim.frames import IDENTITY
from iiwa_sim.motion.blend import HALF, Blend, Move, Zone, blend, joint_ball, shape
from iiwa_sim.motion.blend import sphere as tcp_sphere
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model

ROBOT = load_robot()
MODEL = Model(ROBOT)
LIMITS = JointLimits(np.array(ROBOT.velocity), np.array(ROBOT.acceleration), np.array(ROBOT.jerk))
LOWEST, HIGHEST = np.array(ROBOT.position_min), np.array(ROBOT.position_max)
TARGET = np.array([0.2, 0.5, -0.1, -1.2, 0.3, 0.9, 0.1])
V = np.linspace(0.0, 1.0, 201)


joint_ways = st.lists(st.floats(-0.5, 0.5), min_size=7, max_size=7).map(np.array)


def to_target(
    way: Array, bend: Array, zone: Zone | None, speed_rel: float = 1.0, target: Array = TARGET
) -> Move:
    """A move along a parabola in joint space that comes to the target along `way`."""
    # q(s) = target - (1 - s) way + (1 - s)^2 bend
    return _move(target, -way, bend, zone, speed_rel, at_end=True)


def from_target(way: Array, bend: Array, speed_rel: float = 1.0, target: Array = TARGET) -> Move:
    return _move(target, way, bend, None, speed_rel, at_end=False)


def _move(
    target: Array, way: Array, bend: Array, zone: Zone | None, speed_rel: float, *, at_end: bool
) -> Move:
    # Over r = (1 + x) / 2 or (1 - x) / 2 it is target + r way + r^2 bend.
    sign = -1.0 if at_end else 1.0
    rows = np.array([target + way / 2.0 + bend * 3.0 / 8.0, sign * (way + bend) / 2.0, bend / 8.0])
    far = target + way + bend
    ends = (far, target) if at_end else (target, far)
    path = Polynomial([0.0, 1.0], [rows], *(tuple(end.tolist()) for end in ends))
    limits = LIMITS.at_speed(speed_rel)
    length_s = float((np.abs(path.derivatives(np.linspace(0.0, 1.0, 33))[1]) / limits.velocity).max())
    return Move(0, path, limits, length_s, zone, lambda _: None)


def sphere(radius_m: float, target: Array = TARGET) -> Zone:
    return tcp_sphere(radius_m, tuple(target.tolist()), MODEL.tcp(IDENTITY))


def round_corner(found: Blend, first: Move, second: Move, v: Array = V) -> Array:
    """Joint positions (m, 7)."""
    ending = first.path.derivatives(1.0 - found.before * shape(1.0 - v, found.rho))[0]
    leaving = second.path.derivatives(found.after * shape(v, found.rho))[0]
    return ending + leaving - np.array(second.path.start)


@given(joint_ways, joint_ways, joint_ways, st.floats(0.001, 0.3), st.floats(0.1, 1.0))
def test_the_robot_stays_in_the_sphere_and_leaves_half_of_each_path(
    way: Array, other: Array, bend: Array, radius_m: float, speed_rel: float
) -> None:
    assume(min(np.abs(way).max(), np.abs(other).max()) > 0.05)
    zone = sphere(radius_m)
    first, second = to_target(way, 0.1 * bend, zone, speed_rel), from_target(other, -0.2 * bend)
    found = blend(first, second, LOWEST, HIGHEST)
    assume(found is not None)
    assert found is not None
    assert 0.0 < found.before <= HALF
    assert 0.0 < found.after <= HALF
    assert 0.0 < found.rho <= 1.0
    clipped = zone.clipped(first.path, second.path)
    farthest = float(zone.distances(round_corner(found, first, second)).max())
    # It is looked at in seven places: between them a joint path bends by little.
    assert farthest <= clipped.radius * 1.01


@given(joint_ways, joint_ways, st.floats(0.01, 0.49))
def test_joint_zones_hold_joints(way: Array, other: Array, part: float) -> None:
    assume(min(np.abs(way).max(), np.abs(other).max()) > 0.05)
    straight = np.zeros(7)
    zone = joint_ball(part, tuple((TARGET - way).tolist()), tuple(TARGET.tolist()))
    first, second = to_target(way, straight, zone), from_target(other, straight)
    found = blend(first, second, LOWEST, HIGHEST)
    assume(found is not None)
    assert found is not None
    away = np.abs(round_corner(found, first, second) - TARGET).max()
    assert away <= part * np.abs(way).max() * (1.0 + 1e-9)


def test_a_corner_at_a_joint_limit_is_made_smaller_until_it_keeps_it() -> None:
    # Both paths bulge out of the way to the limit, and together they bulge out twice as far.
    way, other = np.full(7, -0.3), np.full(7, 0.2)
    way[1] = other[1] = 0.0
    bend = np.zeros(7)
    bend[1] = 0.1
    target = TARGET.copy()
    first, second = (
        to_target(way, bend, sphere(0.15, target), target=target),
        from_target(other, bend, target=target),
    )
    wide = blend(first, second, LOWEST, HIGHEST)
    assert wide is not None
    highest = HIGHEST.copy()
    highest[1] = 0.5 * (target[1] + round_corner(wide, first, second)[:, 1].max())
    narrow = blend(first, second, LOWEST, highest)
    assert narrow is not None
    assert narrow.before < wide.before
    assert round_corner(narrow, first, second)[:, 1].max() <= highest[1]


def test_where_there_is_no_zone_or_no_way_or_next_to_none_it_stops_at_the_target() -> None:
    straight = np.zeros(7)
    way, across = np.full(7, 0.2), np.array([0.2, -0.2, 0.2, -0.2, 0.2, -0.2, 0.2])
    assert blend(to_target(way, straight, None), from_target(across, straight), LOWEST, HIGHEST) is None
    standing = from_target(across, straight)._replace(length_s=0.0)
    assert blend(to_target(way, straight, sphere(0.05)), standing, LOWEST, HIGHEST) is None
    # Some micrometres: at a right angle next to nothing is gained, straight on all speed would be lost.
    first = to_target(way, straight, sphere(2e-6))
    assert blend(first, from_target(across, straight), LOWEST, HIGHEST) is None
    assert blend(first, from_target(way, straight), LOWEST, HIGHEST) is not None
