"""A trajectory under way is planned on: the motion up to then stays bit for bit, limits hold behind."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import IDENTITY
from iiwa_sim.motion.blend import Blend, Move, blend, sphere
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.path import ptp
from iiwa_sim.motion.plan_kernel import BlendedPath
from iiwa_sim.motion.trajectory import AT_START, Trajectory, at_once, planned, planned_on
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model

ROBOT = load_robot()
MODEL = Model(ROBOT)
LIMITS = JointLimits(np.array(ROBOT.velocity), np.array(ROBOT.acceleration), np.array(ROBOT.jerk))
LOWEST, HIGHEST = np.array(ROBOT.position_min), np.array(ROBOT.position_max)
START = np.array([0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0])
TICK_S = 0.001
MOST = np.array([1.001, 1.01, 1.01])


def short_moves(
    count: int, way_rad: float, turn_rad: float, radius_part: float, speed_rel: float
) -> list[Move]:
    """A polyline of joints that turns to either side, with spheres of a part of a move's way."""
    limits = LIMITS.at_speed(speed_rel)
    ahead = np.array([0.5, 0.3, 0.2, -0.6, 0.1, 0.4, 0.2])
    aside = np.array([-0.3, 0.5, 0.4, 0.2, 0.5, -0.2, 0.4])
    at, moves = START, []
    for k in range(count):
        heading = turn_rad * (k % 2)
        way = way_rad * (np.cos(heading) * ahead + np.sin(heading) * aside)
        one, other = tuple(at.tolist()), tuple((at + way).tolist())
        tcp = MODEL.tcp(IDENTITY)
        length_m = float(np.linalg.norm(np.subtract(tcp.pose(other).translation, tcp.pose(one).translation)))
        zone = sphere(radius_part * length_m, other, tcp)
        length_s = float((np.abs(way) / limits.velocity).max())
        moves.append(Move(k + 1, ptp(one, other), limits, length_s, zone, lambda _: None))
        at = at + way
    return moves


def corners_of(moves: list[Move]) -> list[Blend]:
    found = [blend(one, other, LOWEST, HIGHEST) for one, other in pairwise(moves)]
    assert None not in found
    return [each for each in found if each is not None]


def trajectory_of(moves: list[Move], corners: list[Blend]) -> Trajectory:
    trajectory = at_once(planned(BlendedPath(moves, corners), AT_START))
    assert trajectory is not None
    return trajectory


def loads(trajectory: Trajectory, from_s: float, limits: JointLimits) -> Array:
    """The largest velocity, acceleration and jerk (3,) between ticks from a time on, over limits."""
    q = trajectory.sample(np.arange(from_s, trajectory.end_s, TICK_S))
    q = np.concatenate([q, [trajectory.end] * 4])
    found = [
        np.abs(np.diff(q, order, axis=0) / TICK_S**order / limit).max()
        for order, limit in enumerate(limits, start=1)
    ]
    return np.array(found)


polylines = st.tuples(
    st.floats(0.003, 0.05), st.floats(0.02, 1.5), st.sampled_from((0.2, 0.5)), st.sampled_from((0.3, 1.0))
)


@given(polylines, st.integers(1, 6))
def test_a_running_trajectory_goes_on_as_it_was_up_to_then_and_within_limits_behind(
    shape: tuple[float, float, float, float], more: int
) -> None:
    moves = short_moves(10 + more, *shape)
    corners = corners_of(moves)
    first = trajectory_of(moves[:10], corners[:9])
    on = at_once(planned_on(first, 0.0, 0.2 * first.end_s, moves[10:], corners[9:]))
    if on is None:
        # It has begun to brake: it comes to rest as planned.
        return
    before = np.arange(max(on.front_s - 0.1, 0.0), on.front_s, 0.0005)
    assert np.array_equal(on.sample(before), first.sample(before))
    assert (loads(on, max(on.front_s - 0.1, 0.0), moves[0].limits) <= MOST).all()
    assert on.joints(on.end_s) == moves[-1].path.end


@pytest.mark.parametrize("turn_rad", [0.05, 0.3, 0.8, 1.5])
@pytest.mark.parametrize("radius_part", [0.2, 0.5])
def test_moves_that_come_one_batch_after_the_other_take_as_long_as_if_known_at_once(
    turn_rad: float, radius_part: float
) -> None:
    moves = short_moves(30, 0.02, turn_rad, radius_part, 1.0)
    corners = corners_of(moves)
    trajectory = trajectory_of(moves[:12], corners[:11])
    for count in range(12, 30, 6):
        on = at_once(
            planned_on(
                trajectory,
                0.0,
                max(trajectory.front_s, trajectory.end_s - 0.8),
                moves[count : count + 6],
                corners[count - 1 : count + 5],
            )
        )
        assert on is not None
        trajectory = on
    assert trajectory.end_s <= 1.02 * trajectory_of(moves, corners).end_s


def test_the_robot_is_exactly_on_the_path_of_one_move_outside_corners() -> None:
    moves = short_moves(12, 0.03, 1.0, 0.2, 1.0)
    corners = corners_of(moves)
    trajectory = trajectory_of(moves, corners)
    times = np.arange(0.0, trajectory.end_s, 0.001)
    path = trajectory.path
    for time_s, q in zip(times.tolist(), trajectory.sample(times), strict=True):
        x = trajectory.x(time_s)
        k = min(int(np.searchsorted(path.borders, x, side="right")) - 1, len(moves) - 1)
        s = (x - path.borders[k]) / moves[k].length_s
        after = corners[k - 1].after if k else 0.0
        before = corners[k].before if k < len(corners) else 0.0
        if after < s < 1.0 - before:
            np.testing.assert_allclose(q, moves[k].path.joints(float(s)), atol=1e-12)
