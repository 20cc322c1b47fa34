"""The wide hunt, with joint trajectories: of all shapes, each in place of whatever runs, ended by anything.

Looked at are ticks, and each way that was planned, whether it was followed to its end or not: where it sets
out, its derivatives at every place, how far it is from what was asked for, and how its end is told.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.joint_trajectories import (
    SHORTEST_S,
    Outcome,
    Tolerance,
    TrajectoryEnd,
    TrajectoryPoint,
    TrajectoryRequest,
)
from iiwa_sim.motion.joint_trajectory import JointTrajectory
from tests.hunting import STEP_S
from tests.stepped import ROUNDING, assert_within_positions
from tests.wide_hunting import WideHunt

OTHERS = 0.5  # part of what is said that `WideHunt` says, too
FASTER = 1.4  # from one attempt to the next, until a trajectory is taken
ATTEMPTS = 8
MOST_PLACES = 2000
NEARLY = (1e-10, 1e-8, 1e-6)  # rad, rad/s, rad/s^2: so near are states that are the same
FIRST_RAD = 0.08


class TrajectoryHunt(WideHunt):
    """One robot, and what it is told."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.accepted = 0
        """Trajectories that were taken."""
        self._told: dict[int, TrajectoryEnd] = {}
        self._numbers: list[int] = []
        self._last: JointTrajectory | None = None
        d = self.robot.description
        self._limits = np.array([d.velocity, d.direct_acceleration, d.direct_jerk])

    def run(self) -> None:
        """Says all of it, waits for the end, and looks whether the end of each trajectory was told."""
        super().run()
        assert sorted(self._told) == self._numbers, "the end of each trajectory is told"

    def _say(self, what: float) -> None:
        if self._rng.random() < OTHERS:
            super()._say(what)
        elif self._how in ("stops", "all") and what < 0.15 and self._numbers:
            self.robot.notice_mode()
            self.robot.may_stop()
            self.robot.controller.cancel_trajectory(self._one_of(self._numbers[-2:]))
        else:
            self._says_trajectory()

    def _says_trajectory(self) -> None:
        """One, or a stream of some that each take over from the one before."""
        rng = self._rng
        for _ in range(self._one_of((1, 1, 1, 2, 3, 12))):
            if not self._sends(self._points()):
                return
            if self._how != "once":
                self._step(self._one_of((0, 1, int(rng.integers(0, 30)), int(rng.integers(0, 400)))))

    def _sends(self, points: list[TrajectoryPoint]) -> bool:
        """Send points, slower and slower until the robot takes them; whether it did."""
        rng, robot, controller = self._rng, self.robot, self.robot.controller
        names, executor = robot.description.joints, robot.controller.motions._executor
        more: dict[str, Any] = {"delay_s": self._one_of((0.0, 0.0, 0.0, 0.2, -0.02))}
        more["may_end_fast"] = any(points[-1].velocities)
        if rng.random() < 0.1:
            more["path_tolerance"] = {name: Tolerance(float(10.0 ** rng.uniform(-4, -1))) for name in names}
        if rng.random() < 0.1:
            more["goal_tolerance"] = {name: Tolerance(1e-9, 1e-6) for name in names}
            more["goal_time_s"] = float(rng.uniform(0.0, 0.05))
        own: list[int] = []

        def ended(end: TrajectoryEnd) -> None:
            assert own[0] not in self._told, "the end of a trajectory is told twice"
            self._told[own[0]] = end
            if end.outcome is Outcome.REACHED:
                assert controller.joints == tuple(points[-1].positions), "it ends beside its last point"
            if end.outcome in (Outcome.PATH_TOLERANCE, Outcome.GOAL_TOLERANCE):
                robot._stop_ticks = robot._longest_stop + 1  # it begins in the next tick

        robot.notice_mode()
        before = controller.end_of_queue
        followed = controller.motions.tracked
        state = executor.state if followed else None
        for _ in range(ATTEMPTS):
            try:
                number, _ = controller.follow(TrajectoryRequest(names, points, **more), ended)
            except Refused:
                points = [
                    TrajectoryPoint(
                        FASTER * point.time_s,
                        point.positions,
                        [v / FASTER for v in point.velocities],
                        [a / FASTER**2 for a in point.accelerations],
                    )
                    for point in points
                ]
                continue
            break
        else:
            return False
        own.append(number)
        robot.notice_mode()
        self._starts.append(before)
        self._numbers.append(number)
        self.accepted += 1
        following = controller.motions._next
        way = executor.trajectory if following is None else following.way
        if state is None:
            here = controller.motions.rest_after_stop()
            state = here, (0.0,) * len(here), (0.0,) * len(here)
        self._look_at_way(way, state)
        return True

    def _points(self) -> list[TrajectoryPoint]:
        """Of a trajectory from where the robot will be: some are too fast."""
        rng, controller, d = self._rng, self.robot.controller, self.robot.description
        followed = controller.motions.tracked
        here = np.array(
            followed.reference.at(controller.motions.tracked_s)[0]
            if followed
            else controller.motions.rest_after_stop()
        )
        low, high, fast = np.array(d.position_min), np.array(d.position_max), np.array(d.velocity)
        count = self._one_of((1, 2, 2, 3, 5, int(rng.integers(2, 30)), int(rng.integers(2, 200))))
        spaces = self._one_of((0.02, 0.1, 0.4, 10.0 ** float(rng.uniform(-4.0, 0.0))))
        uneven = self._one_of((1.0, 0.1, 0.001))
        gaps = np.maximum(spaces * rng.uniform(uneven, 1.0, count), 1.01 * SHORTEST_S)
        times = np.cumsum(gaps)
        share = self._one_of((1.0, 0.5, 0.1, 1e-3, 1e-7))
        ways = share * fast * rng.uniform(-1.0, 1.0, (count, len(here)))
        shape = self._one_of(("random", "random", "even", "one joint", "to and fro", "still", "wave"))
        if shape == "even":
            ways[:] = ways[0]
        elif shape == "one joint":
            ways[:, np.arange(len(here)) != int(rng.integers(len(here)))] = 0.0
        elif shape == "to and fro":
            ways = np.abs(ways[:1]) * (-1.0) ** np.arange(count)[:, None]
        elif shape == "still":
            ways[rng.random(count) < 0.5] = 0.0
        elif shape == "wave":
            ways = np.sin(np.linspace(0.0, self._one_of((np.pi, 20.0)), count))[:, None] * ways[:1]
        places = np.clip(here + np.cumsum(ways * gaps[:, None], axis=0), low, high)
        begins = self._one_of(("later", "later", "here", "beside"))
        if begins != "later":
            off = 0.0 if begins == "here" else FIRST_RAD * rng.uniform(-1.0, 1.0, len(here)) * share
            times = np.append(0.0, times)
            places = np.vstack([np.clip(here + off, low, high), places])
        speeds = np.gradient(places, times, axis=0) if len(times) > 1 else np.zeros_like(places)
        bends = np.gradient(speeds, times, axis=0) if len(times) > 1 else np.zeros_like(places)
        if rng.random() < 0.3:
            speeds *= rng.uniform(0.0, 1.0, speeds.shape)
            bends *= rng.uniform(-1.0, 1.0, bends.shape)
        ends_fast = rng.random() < 0.15
        if not ends_fast:
            speeds[-1] = 0.0
        if begins == "here" and rng.random() < 0.7:
            speeds[0] = bends[0] = 0.0
        has_speeds = rng.random(len(times)) < self._one_of((0.0, 0.5, 1.0, 1.0))
        has_bends = rng.random(len(times)) < self._one_of((0.0, 0.5, 1.0))
        if ends_fast:
            has_speeds[-1] = True
        return [
            TrajectoryPoint(
                float(time),
                place.tolist(),
                speed.tolist() if with_speed else (),
                bend.tolist() if with_bend else (),
            )
            for time, place, speed, bend, with_speed, with_bend in zip(
                times, places, speeds, bends, has_speeds, has_bends, strict=True
            )
        ]

    def _look_at_way(self, way: JointTrajectory, state: tuple[Any, Any, Any]) -> None:
        """Whether it sets out where and as the robot is, keeps its limits everywhere, and is near enough."""
        self.plans_seen += 1
        places = min(max(int(way.end_s / STEP_S), 20), MOST_PLACES)
        times = np.linspace(0.0, way.end_s, places + 1)
        found = np.array([way.state(time) for time in times.tolist()])
        assert_within_positions(self.robot.description, found[:, 0])
        jerk = np.diff(found[:, 2], axis=0) / (times[1] - times[0])
        derivatives = found[:, 1], found[:, 2], jerk
        loads = [(np.abs(each) / limit).max() for each, limit in zip(derivatives, self._limits, strict=True)]
        self.plans = np.maximum(self.plans, loads)
        _assert_meets(way.state(0.0), state)
        reference = way.reference
        on_it = (times > way.join_s) & (times < reference.end_s)  # behind that it comes in from where it is
        asked = np.array([reference.at(time)[0] for time in times[on_it].tolist()]).reshape(-1, len(way.end))
        error = reference.range(1).magnitude * 0.5 * (way.end_s - reference.end_s)
        assert (np.abs(found[on_it, 0] - asked) <= error + ROUNDING).all(), "farther off than is said"


def _assert_meets(one: tuple[Any, Any, Any], other: tuple[Any, Any, Any]) -> None:
    """Positions, velocities and accelerations."""
    for a, b, near in zip(one, other, NEARLY, strict=True):
        off = float(np.abs(np.subtract(a, b)).max())
        assert off <= near, f"{off} beside each other"


def trajectories(seed: int) -> dict[str, float]:
    """Hunt by a seed."""
    return TrajectoryHunt(seed).check()


@pytest.mark.slow
@pytest.mark.requirement("FRC003", "FRC005", "FRC013", "FRC016", "FRC025")
@given(st.integers(0, 2**32 - 1))
def test_whatever_trajectories_are_sent_and_when_all_limits_are_kept(seed: int) -> None:
    trajectories(seed)
