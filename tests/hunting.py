"""Moves of all kinds sent at any time, by a seed, to a controller alone: cheap enough to hunt by thousands.

Not only ticks are looked at, but every plan that was taken, also where another one took its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.motion.queue.chain import Chain
from tests.asked import joint_move, lin_joint_move, lin_move, ptp_move
from tests.stepped import ROBOTS, Array, SteppedRobot, worst_loads

KINDS = ("joint", "ptp", "ptpr", "lin", "linr", "lin joint")
PLACES = ("near", "near", "shift", "shift", "shift", "far", "small", "tiny", "same", "turn", "back", "on")
SPEEDS = (1.0, 1.0, 0.7, 0.5, 0.3, 0.1, 0.05)
TICKS_S = (0.001, 0.001, 0.002, 0.002, 0.004, 0.01)
HOW = ("once", "bits", "stops", "overrides", "all")
LEAST_FAR_SPEED = 0.3
STEP_S = 0.0005  # between places of a plan that are looked at
UNTIL_STOPPED = -1


class Hunt:
    """One robot, and what it is told."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        name = self._one_of(ROBOTS)
        self.robot = SteppedRobot(name, self._one_of(TICKS_S))
        self._how = self._one_of(HOW)
        self._starts: list[Array] = []  # of the moves that were accepted
        self._version = 0  # of the plan that was looked at last
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

    def loads(self) -> dict[str, float]:
        """The largest of velocity, acceleration and jerk over their limits, by ticks and in plans."""
        found = worst_loads(self.robot)
        return {each: max(found[each], float(plan)) for each, plan in zip(found, self.plans, strict=True)}

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
        drive = self.robot.controller._core.motions._drive
        for _ in range(ticks):
            self.robot.step()
            if drive._chain is not None and drive._chain.version != self._version:
                self._version = drive._chain.version
                self._look_at(drive._chain)

    def _look_at(self, plan: Chain) -> None:
        self.plans_seen += 1
        times = np.arange(plan.front_s, plan.rest_s, STEP_S)
        if len(times):
            derivatives, limits = plan.along(times)
            loads = (np.abs(derivatives[:, 1:]) / limits).max(axis=(0, 2))
            self.plans = np.maximum(self.plans, loads)

    def _send(self) -> None:
        robot, controller, d = self.robot, self.robot.controller, self.robot.description
        joint_count = len(d.joints)
        kind, place = self._one_of(KINDS), self._one_of(PLACES)
        parts = self._rng.uniform(-1.0, 1.0, joint_count)
        if self._rng.random() < 0.3:
            parts = np.array([self._one_of((0.0, 0.0, -1.0, -0.5, 0.5, 1.0)) for _ in range(joint_count)])
        speeds = [self._one_of(SPEEDS) for _ in range(joint_count)]
        if self._rng.random() < 0.5:
            speeds = speeds[:1] * joint_count
        if place == "far":
            speeds = [max(speed, LEAST_FAR_SPEED) for speed in speeds]
        radius_mm = self._one_of((*(self._rng.uniform(*each) for each in ((0, 80), (5, 80), (0, 5))), 500.0))
        end = np.array(controller.end_of_queue)
        joints, frame = self._target(kind, place, parts, end)
        a3 = joints[2]
        requests: dict[str, MoveRequest] = {
            "joint": joint_move(joints, speeds),
            "ptp": ptp_move(frame, speeds[0], radius_mm),
            "ptpr": ptp_move(frame, speeds[0], radius_mm, a3),
            "lin": lin_move(frame, speeds[0], radius_mm),
            "linr": lin_move(frame, speeds[0], radius_mm, a3),
            "lin joint": lin_joint_move(joints, speeds[0], radius_mm),
        }
        robot.notice_mode()
        try:
            controller.move(requests[kind])
        except Refused:
            return
        self._starts.append(end)

    def _target(self, kind: str, place: str, parts: Array, end: Array) -> tuple[tuple[float, ...], Frame]:
        """Joints and frame of a target; where the frame is shifted, the joints are only near."""
        robot, d = self.robot, self.robot.description
        centre = 0.5 * np.add(d.position_min, d.position_max)
        reach = 0.5 * np.subtract(d.position_max, d.position_min)
        last = self._starts[-1] if self._starts else end
        toward = {
            "near": end + 0.12 * reach * parts,
            "far": end + 0.12 * reach * parts if kind.startswith("lin") else centre + 0.75 * reach * parts,
            "shift": end + 0.06 * reach * parts,
            "small": end + 2e-3 * parts,
            "tiny": end + 10.0 ** (-9.0 + 6.0 * abs(parts[0])) * parts,
            "same": end,
            "turn": end + np.append(np.zeros(len(end) - 1), parts[-1]),
            "back": last,
            "on": end + 0.5 * (end - last),
        }
        joints = tuple(np.clip(toward[place], centre - 0.97 * reach, centre + 0.97 * reach).tolist())
        here = robot.tcp_frame(end.tolist())
        way = np.concatenate([250.0 * parts[:3], 0.6 * parts[3:6]])
        if place == "turn":
            way[:3] = 0.0
        elif place == "small":
            way *= 0.01
        elif place == "on":
            way[:3] = 0.5 * np.subtract(here[:3], robot.tcp_frame(last.tolist())[:3])
            way[3:] = 0.0
        elif place != "shift":
            return joints, robot.tcp_frame(joints)
        return joints, Frame(*np.add(here, way).tolist())
