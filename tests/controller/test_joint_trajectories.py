"""Joint trajectories: followed within limits and tolerances, refused with a reason."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import EXECUTION, STOP_TRIGGERED, SUCCESS, Refused
from iiwa_sim.controller.joint_trajectories import CANCELLED, MOST_POINTS, TrajectoryRequest
from iiwa_sim.controller.modes import Mode
from iiwa_sim.motion.joint_trajectory import Knot
from iiwa_sim.robot.nearest import JOINT_LIMIT
from tests.requests import joint_move, smart_joint_move
from tests.stepped import ARMS, SteppedRobot, assert_within_limits, strong

Array = NDArray[np.float64]

TICK_S = 0.002
EVERY = 10  # ticks between looks at how the robot follows


class TrajectoryRobot:
    """A robot that is sent trajectories, with their endings and its deviation from them."""

    def __init__(self, name: str = ARMS[0], tick_s: float = TICK_S) -> None:
        """The robot has joints that no force stops: some random programs fold the arm."""
        self.robot = SteppedRobot(strong(name), tick_s)
        self.controller = self.robot.controller
        self.names = self.robot.description.joints
        self.home = np.array(self.robot.description.home)
        self.ends: dict[int, Ending] = {}
        self.desired: list[Array] = []
        self.actual: list[Array] = []

    def sends(self, points: Sequence[Knot], **more: Any) -> int:
        def ended(ending: Ending) -> None:
            assert ending.move not in self.ends, "reported twice"
            self.ends[ending.move] = ending

        self.robot.notice_mode()
        request = TrajectoryRequest(more.pop("joints", self.names), points, **more)
        number = self.controller.trajectories.follow(request, ended)
        self.robot.notice_mode()
        return number

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.robot.step()
            progress = None if self.controller.tick % EVERY else self.controller.trajectories.progress
            if progress is not None:
                self.desired.append(np.array(progress.desired[0]))
                self.actual.append(np.array(progress.actual[0]))

    def runs(self, limit_s: float = 600.0) -> None:
        ticks = 0
        while self.controller.moving:
            self.step()
            ticks += 1
            assert ticks * self.robot.tick_s < limit_s, "still moving"
        self.step(2)

    def error(self) -> Array:
        """Return the greatest deviation of each joint from the reference (rad)."""
        worst: Array = np.abs(np.subtract(self.desired, self.actual)).max(axis=0)
        return worst


def swinging(
    robot: TrajectoryRobot, times: Array, size: float, turns: Array, *, bent: bool = True
) -> list[Knot]:
    """Return points of a smooth motion from rest to rest, with velocities, and `bent` accelerations."""
    whole = float(times[-1])
    x = times / whole
    polynomial = np.polynomial.Polynomial([0, 0, 0, 64.0]) * np.polynomial.Polynomial([1, -1]) ** 3
    bell, slope, bend = polynomial(x), polynomial.deriv()(x) / whole, polynomial.deriv(2)(x) / whole**2
    room = size * np.array(robot.robot.description.velocity) * whole / 8.0
    room = np.minimum(room, 0.3) * turns
    points = []
    for k, time in enumerate(times):
        accelerations = (bend[k] * room).tolist() if bent else ()
        points.append(
            Knot(
                float(time), (robot.home + bell[k] * room).tolist(), (slope[k] * room).tolist(), accelerations
            )
        )
    return points


AVERAGED_S = 0.1
signs = st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7).map(np.array)


@given(st.integers(2, 200), st.floats(0.5, 5.0), st.floats(0.05, 0.9), signs, st.booleans())
def test_a_smooth_trajectory_with_velocities_is_followed_closely(
    count: int, whole_s: float, size: float, turns: Array, bent: bool
) -> None:
    following = TrajectoryRobot()
    points = swinging(following, np.linspace(0.0, whole_s, count + 1), size, turns, bent=bent)
    following.sends(points)
    following.runs()
    assert [end.code for end in following.ends.values()] == [SUCCESS]
    assert_within_limits(following.robot)
    # An average smooths the curve: the fastest joint may be half its width behind or ahead.
    fastest = np.abs(np.diff(following.robot.joints, axis=0)).max(axis=0) / TICK_S
    assert (following.error() <= 0.5 * AVERAGED_S * fastest + 1e-9).all()


@given(st.lists(st.tuples(st.floats(0.05, 0.6), signs), min_size=1, max_size=8), st.booleans())
def test_points_at_speed_or_with_corners_are_followed_within_the_limits(
    parts: list[tuple[float, Array]], gentle: bool
) -> None:
    """Straight lines from point to point; the average rounds their corners."""
    following = TrajectoryRobot()
    speed = (0.1 if gentle else 0.9) * np.array(following.robot.description.velocity)
    time, place, points = 0.0, following.home, []
    for seconds, turns in parts:
        time, place = (
            time + seconds,
            (place + seconds * speed * turns).clip(following.home - 0.5, following.home + 0.5),
        )
        points.append(Knot(time, place.tolist()))
    following.sends(points)
    following.runs()
    assert [end.code for end in following.ends.values()] == [SUCCESS]
    assert following.controller.joints == tuple(place.tolist())
    assert_within_limits(following.robot)


def test_joints_may_come_in_any_order() -> None:
    following, mixed = TrajectoryRobot(), TrajectoryRobot()
    points = swinging(following, np.linspace(0.0, 2.0, 9), 0.5, np.linspace(-1.0, 1.0, 7))
    following.sends(points)
    order = [3, 0, 6, 1, 5, 2, 4]
    permuted = [
        Knot(p.time_s, *([row[k] for k in order] for row in (p.positions, p.velocities, p.accelerations)))
        for p in points
    ]
    mixed.sends(permuted, joints=[mixed.names[k] for k in order])
    following.runs()
    mixed.runs()
    assert following.robot.joints == mixed.robot.joints


AWAY = [0.2, 0.7, 0.2, -0.9, 0.2, 1.2, 0.2]
NEAR = [0.01, 0.53, 0.01, -1.05, 0.01, 1.56, 0.01]


def bad(**change: Any) -> dict[str, Any]:
    whole: dict[str, Any] = {"points": [Knot(1.0, NEAR), Knot(2.0, AWAY)]}
    return whole | change


def with_value(place: int, value: float) -> list[float]:
    return [*AWAY[:place], value, *AWAY[place + 1 :]]


BAD = {
    "no points": (bad(points=[]), "0 points"),
    "too many": (bad(points=[Knot(1e-3 * k, NEAR) for k in range(MOST_POINTS + 1)]), "2001"),
    "an unknown joint": (bad(joints=["A1", "A2", "A3", "A4", "A5", "A6", "B7"]), "'B7'"),
    "a joint twice": (bad(joints=["A1", "A2", "A3", "A4", "A5", "A6", "A6"]), "each of"),
    "six positions": (bad(points=[Knot(1.0, AWAY[:6])]), "6 positions"),
    "eight accelerations": (bad(points=[Knot(1.0, AWAY, [0.0] * 7, [0.0] * 8)]), "8 acc"),
    "nan": (bad(points=[Knot(1.0, with_value(3, nan))]), "not finite"),
    "infinite velocity": (bad(points=[Knot(1.0, AWAY, [inf] * 7)]), "not finite"),
    "time stands still": (bad(points=[Knot(2.0, NEAR), Knot(2.0, AWAY)]), "not later"),
    "years": (bad(points=[Knot(1e8, NEAR)]), "86400 s"),
    "all over": (bad(delay_s=-3.0), "1.000 s ago"),
    "moves at its end": (bad(points=[Knot(1.0, AWAY, [0.1] * 7)]), "velocity"),
    "beyond a joint limit": (bad(points=[Knot(5.0, with_value(1, 2.2))]), "A2 at"),
    "beyond it between points": (
        bad(
            points=[
                Knot(4.0, with_value(5, 2.05), [0.0] * 5 + [1.0, 0.0]),
                Knot(6.0, with_value(5, 2.05), [0.0] * 7),
            ]
        ),
        "A6 at",
    ),
    "too fast": (bad(points=[Knot(0.05, AWAY)]), "faster"),
    "begins elsewhere": (bad(points=[Knot(0.0, AWAY), Knot(2.0, AWAY)]), "begins"),
}


def under_way() -> tuple[TrajectoryRobot, int]:
    """Return a robot 0.4 s after the beginning of a trajectory, with its number."""
    following = TrajectoryRobot()
    number = following.sends([Knot(1.0, NEAR), Knot(3.0, AWAY)])
    following.step(200)
    return following, number


def test_bad_trajectories_are_refused_with_their_reason_and_change_nothing() -> None:
    (following, _), (other, _) = under_way(), under_way()
    for name, (message, reason) in BAD.items():
        with pytest.raises(Refused) as refused:
            following.sends(**message)
        assert reason in refused.value.reason, name
        assert refused.value.code in (EXECUTION, JOINT_LIMIT)
        following.step()
    for each in (following, other):
        each.runs()
    assert following.robot.joints == other.robot.joints


def test_the_robot_stops_on_its_path_and_holds_when_a_trajectory_is_cancelled() -> None:
    following = TrajectoryRobot()
    number = following.sends([Knot(2.0, AWAY)])
    following.step(400)
    following.robot.may_stop()
    following.controller.trajectories.cancel(number)
    following.controller.trajectories.cancel(number)
    assert following.ends == {number: Ending(number, STOP_TRIGGERED, CANCELLED)}
    following.runs(0.2)
    assert following.controller.mode is Mode.TRAJECTORY
    assert_within_limits(following.robot)
    along = np.subtract(following.controller.joints, following.home) / np.subtract(AWAY, following.home)
    assert np.ptp(along) < 1e-6, "off the straight line"
    assert 0.1 < along[0] < 0.9
    following.sends([Knot(2.0, AWAY)])
    following.runs()
    assert following.controller.joints == tuple(AWAY)


@given(st.lists(st.tuples(st.integers(1, 400), signs, st.booleans()), min_size=2, max_size=4))
def test_a_newer_trajectory_takes_over_in_mid_motion(parts: list[tuple[int, Array, bool]]) -> None:
    following = TrajectoryRobot()
    numbers, target = [], following.home
    for ticks, turns, smooth in parts:
        target = following.home + 0.35 * turns
        still = [0.0] * 7 if smooth else ()
        numbers.append(following.sends([Knot(1.5, target.tolist(), still)]))
        following.step(ticks)
    following.runs()
    assert_within_limits(following.robot)
    assert following.controller.joints == tuple(target.tolist())
    assert following.ends[numbers[-1]].code == SUCCESS
    for number, (ticks, _, _) in zip(numbers[:-1], parts, strict=False):
        expected = Ending(number, STOP_TRIGGERED, "preempted by a newer trajectory")
        assert following.ends[number] == expected or ticks * TICK_S >= 1.5


def test_a_stream_like_moveit_servos_is_followed_without_a_stop() -> None:
    following = TrajectoryRobot()
    place = following.home
    for k in range(100):
        time = 0.01 * (k + 1)
        along = 0.3 * (1.0 - np.cos(2.0 * time))
        speed = 0.6 * np.sin(2.0 * time)
        place = following.home + along * np.array([1.0, 0, 0, 0, 0, 0, 0])
        velocity = [speed, 0, 0, 0, 0, 0, 0]
        following.sends([Knot(0.02, place.tolist(), velocity)], may_end_fast=True)
        following.step(5)
    following.runs()
    assert_within_limits(following.robot)
    first = np.diff(np.array(following.robot.joints)[:, 0])[200:450] / TICK_S
    assert first.min() > 0.2, "it stops and goes"
    assert np.abs(following.controller.joints[0] - place[0]) < 1e-9


def test_time_runs_at_the_override() -> None:
    following = TrajectoryRobot()
    following.controller.set_override(0.5)
    points = swinging(following, np.linspace(0.0, 0.8, 9), 0.5, np.ones(7))
    number = following.sends(points)
    following.runs()
    assert following.ends[number].code == SUCCESS
    assert len(following.robot.joints) * TICK_S == pytest.approx(1.6, rel=0.05)
    following.sends(points)
    for override, ticks in ((1.0, 150), (0.4, 100), (0.0, 200), (1.0, 0)):
        following.controller.set_override(override)
        following.step(ticks)
    following.runs()
    assert_within_limits(following.robot)
    assert following.controller.joints == tuple(points[-1].positions)


@pytest.mark.parametrize(
    ("tolerances", "reason"),
    [
        ({"path_tolerance": {"A3": 1e-3}}, r"path tolerance: A3 is 0\.001\d* rad off after 0\.\d+ s"),
        ({"path_tolerance": {"A3": 0.2, "A1": 0.0, "A2": -1.0}}, ""),
        (
            {"goal_tolerance": {"A1": 1e-4}, "goal_time_s": 0.005},
            "goal tolerance: A1 .* more than 0.0001",
        ),
        ({"goal_tolerance": {"A1": 1e-4}, "goal_time_s": 1.0}, ""),
        ({"goal_tolerance": {"A1": 1e-4}}, ""),
    ],
)
def test_a_robot_that_is_beyond_a_tolerance_stops(tolerances: dict[str, Any], reason: str) -> None:
    """To and fro in straight lines, which the robot follows with a delay."""
    following = TrajectoryRobot()
    places = [(following.home + 0.3 * (k % 2)).tolist() for k in range(4)]
    number = following.sends([Knot(0.5 * k, places[k]) for k in (1, 2, 3)], **tolerances)
    following.robot.may_stop()
    following.runs()
    assert_within_limits(following.robot)
    ending = following.ends[number]
    assert ending.code == (STOP_TRIGGERED if reason else SUCCESS)
    assert re.match(reason or "$", ending.reason), ending.reason
    assert (following.controller.joints == tuple(places[-1])) is not bool(reason)


def test_other_motions_and_trajectories_stop_each_other() -> None:
    following = TrajectoryRobot()
    following.controller.move(joint_move(AWAY, [1.0] * 7))
    following.step(150)
    first = following.sends([Knot(1.0, NEAR)])
    following.step(250)
    following.robot.notice_mode()
    following.controller.move(smart_joint_move(AWAY, [1.0] * 7))
    assert following.ends[first].code == STOP_TRIGGERED
    following.step(300)
    second = following.sends([Knot(1.0, NEAR)])
    following.runs()
    assert following.ends[second].code == SUCCESS
    assert following.controller.joints == tuple(NEAR)
    assert_within_limits(following.robot)


def test_a_trajectory_with_an_earlier_start_is_joined_at_its_present_point() -> None:
    following = TrajectoryRobot()
    points = swinging(following, np.linspace(0.0, 2.0, 21), 0.15, np.ones(7))
    number = following.sends(points, delay_s=-0.5)
    following.runs()
    assert following.ends[number].code == SUCCESS
    assert len(following.robot.joints) * TICK_S == pytest.approx(1.5, abs=0.1)
    late = np.abs(np.subtract(following.desired, following.actual))[500 // EVERY :]
    assert late.max() < 1e-9, "it never came onto the curve"
    assert_within_limits(following.robot)
