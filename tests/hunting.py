"""Moves of all kinds sent at any time, by a seed, to a controller alone: cheap enough to hunt by thousands.

Not only ticks are looked at, but every plan that was taken, also where another one took its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.trajectory import Trajectory
from tests.chains import KINDS, PLACES, SPEEDS, UNTIL_STOPPED, ChainMove, send
from tests.stepped import ROBOTS, SteppedRobot, assert_loads_are_within, worst_loads

TICKS_S = (0.001, 0.001, 0.002, 0.002, 0.004, 0.01)
HOW = ("once", "bits", "stops", "overrides", "all")
STEP_S = 0.0005  # between places of a plan that are looked at
LEAST_SPEED = 0.05
MOST_IN_PLANS = (1.005, 1.01, 1.1)  # velocity, acceleration and jerk between ticks, over their limits


class Hunt:
    """One robot, and what it is told."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        name = self._one_of(ROBOTS)
        self.robot = SteppedRobot(name, self._one_of(TICKS_S))
        self._how = self._one_of(HOW)
        self._starts: list[Joints] = []  # of the moves that were accepted
        self._seen: Trajectory | None = None  # the plan that was looked at last
        self.plans = np.zeros(3)
        """The largest velocity, acceleration and jerk in any plan, over their limits."""
        self.plans_seen = 0

    def _one_of(self, choice: Sequence[Any]) -> Any:
        return choice[int(self._rng.integers(len(choice)))]

    def run(self) -> None:
        """Says all of it, and waits for the end."""
        for _ in range(int(self._rng.integers(2, 16))):
            self._say(self._rng.random())
            if self._how != "once":
                self._wait(self._one_of((0, 0, int(self._rng.integers(0, 400)), UNTIL_STOPPED)))
        controller = self.robot.controller
        controller.set_override(max(controller.override, 0.3))
        self._wait(UNTIL_STOPPED)
        self._step(3)

    def check(self) -> dict[str, float]:
        """Runs; gives the loads, which are within the limits."""
        self.run()
        loads = worst_loads(self.robot)
        assert_loads_are_within(loads)
        assert (self.plans <= MOST_IN_PLANS).all(), self.plans
        return loads

    def _say(self, what: float) -> None:
        robot, controller = self.robot, self.robot.controller
        if self._how in ("stops", "all") and what < 0.1:
            robot.stop()
        elif self._how == "all" and what < 0.2:
            robot.cancel()
        elif self._how == "all" and what < 0.3:
            robot.clears_queue(controller.move_under_way)
        elif self._how in ("overrides", "all") and what < 0.5:
            value = self._one_of((0.0, 1.0, *self._rng.uniform(0.2, 1.0, 2).tolist()))
            controller.set_override(value)
            if value == 0.0:
                self._step(int(self._rng.integers(0, 500)) // round(1e3 * robot.tick_s))
                controller.set_override(0.4)
        else:
            self._send()

    def _wait(self, ticks: int) -> None:
        if ticks == UNTIL_STOPPED:
            while self.robot.controller.moving:
                self._step(1)
        else:
            self._step(ticks)

    def _step(self, ticks: int) -> None:
        executor = self.robot.controller.motions._executor
        for _ in range(ticks):
            self.robot.step()
            if executor._queued is not None and executor._queued is not self._seen:
                self._seen = executor._queued
                self._look_at(executor._queued)

    def _look_at(self, plan: Trajectory) -> None:
        self.plans_seen += 1
        times = np.arange(plan.front_s, plan.end_s, STEP_S)
        if len(times):
            derivatives, limits = plan.along(times)
            loads = (np.abs(derivatives[:, 1:]) / limits).max(axis=(0, 2))
            self.plans = np.maximum(self.plans, loads)

    def _send(self) -> None:
        joint_count = len(self.robot.description.joints)
        kind, place = self._one_of(KINDS), self._one_of(PLACES)
        parts = self._rng.uniform(-1.0, 1.0, joint_count)
        if self._rng.random() < 0.3:
            parts = np.array([self._one_of((0.0, 0.0, -1.0, -0.5, 0.5, 1.0)) for _ in range(joint_count)])
        speeds = [self._one_of((*SPEEDS, LEAST_SPEED)) for _ in range(joint_count)]
        if self._rng.random() < 0.5:
            speeds = speeds[:1] * joint_count
        radius_mm = self._one_of((*(self._rng.uniform(*each) for each in ((0, 80), (5, 80), (0, 5))), 500.0))
        move = ChainMove(kind, place, tuple(parts), tuple(speeds), radius_mm, 0)
        end = self.robot.controller.end_of_queue
        self.robot.notice_mode()
        if send(self.robot, move, self._starts[-1] if self._starts else end):
            self._starts.append(end)
