"""Random programs: moves of every kind, waits and stops, for any robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st

from iiwa_sim.controller.errors import Refused
from iiwa_sim.robot.description import RobotDescription
from tests.asked import joint_move, lin_move, ptp_move
from tests.stepped import SteppedRobot

REACH = 0.75  # of the position limits: room for lines between the targets


@dataclass(frozen=True)
class Move:
    """To the pose of `joints`; how, how fast, and how many ticks pass before the next is sent."""

    kind: str
    joints: tuple[float, ...]
    speeds_rel: tuple[float, ...]
    wait: int
    short: bool

    def send(self, robot: SteppedRobot) -> bool:
        """Whether it was accepted."""
        c = robot.controller
        joints: Sequence[float] = self.joints
        if self.short:  # next to where the robot is now, so that lines are within reach
            d = robot.description
            off_centre = np.array(self.joints) - 0.5 * np.add(d.position_min, d.position_max)
            joints = np.add(c.joints, 0.15 * off_centre).tolist()
        frame = robot.tcp_frame(joints)
        speed = self.speeds_rel[0]
        try:
            if self.kind == "joint":
                c.move(joint_move(joints, self.speeds_rel))
            elif self.kind == "ptp":
                c.move(ptp_move(frame, speed, 10.0))
            elif self.kind == "ptpr":
                c.move(ptp_move(frame, speed, 10.0, joints[2]))
            elif self.kind == "lin":
                c.move(lin_move(frame, speed, 10.0))
            else:
                c.move(lin_move(frame, speed, 10.0, joints[2]))
        except Refused:
            return False
        return True


@dataclass(frozen=True)
class Stop:
    """A stop, and the ticks before what follows is sent."""

    wait: int

    def send(self, robot: SteppedRobot) -> bool:
        robot.stop()
        return True


def moves(description: RobotDescription) -> st.SearchStrategy[Move]:
    parts = st.floats(-REACH, REACH, allow_subnormal=False)
    limits = list(zip(description.position_min, description.position_max, strict=True))
    joints = st.tuples(
        *(
            parts.map(lambda part, low=low, high=high: 0.5 * (low + high + part * (high - low)))
            for low, high in limits
        )
    )
    speeds = st.tuples(*(st.sampled_from([1.0, 0.7, 0.2]) for _ in limits))
    kinds = st.sampled_from(["joint", "ptp", "ptpr", "lin", "linr"])
    return st.builds(Move, kinds, joints, speeds, st.integers(0, 300), st.booleans())


def programs(description: RobotDescription, stops: bool = True) -> st.SearchStrategy[list[Any]]:
    step: st.SearchStrategy[Any] = moves(description)
    if stops:
        step = st.one_of(step, step, step, st.builds(Stop, st.integers(0, 100)))
    return st.lists(step, min_size=2, max_size=8)


def run(robot: SteppedRobot, program: list[Any]) -> int:
    """Sends a program at its ticks, and waits for the end; returns how many moves were accepted."""
    accepted = 0
    for item in program:
        accepted += item.send(robot)
        robot.step(item.wait)
    robot.runs_until_stopped()
    robot.step(3)
    return accepted
