"""At every pace of time, commands at given ticks make a given motion, bit for bit."""

from __future__ import annotations

import asyncio
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from iiwa_sim.clock.clock import Clock
from iiwa_sim.clock.pace import FAST, REAL, STEPPED, Pace, pace
from iiwa_sim.robot.description import load_robot
from tests.clock.hand_time import MS_NS, HandTime
from tests.sequences import send, sequences
from tests.stepped import SteppedRobot

PACES = [REAL, pace("10x"), FAST]


class ProgrammedRobot:
    """Sends itself a program, each command in its tick."""

    def __init__(self, program: list[Any]) -> None:
        self.robot = SteppedRobot()
        self._program = list(program)
        self._at_tick = 0
        self.answers: list[bool] = []

    def step(self, at_most: int = 1) -> int:  # noqa: ARG002
        while self._program and self.robot.controller.tick == self._at_tick:
            item = self._program.pop(0)
            self.answers.append(send(self.robot, item))
            self._at_tick += max(item.wait, 0)
        self.robot.step()
        return 1

    @property
    def accepted(self) -> int:
        return self.robot.controller.accepted

    @property
    def moving(self) -> bool:
        return bool(self._program) or self.robot.controller.moving

    @property
    def under_way(self) -> bool:
        return self.robot.controller.under_way

    @property
    def resting(self) -> bool:
        return not self._program and self.robot.controller.resting

    def skip(self, ticks: int) -> None:
        self.robot.controller.skip(ticks)


def paced(program: list[Any], pace: Pace, late_ns: list[int]) -> ProgrammedRobot:
    robot, time = ProgrammedRobot(program), HandTime()
    Clock(pace=pace, now_ns=time.now, call_at=time.call_at).start(robot)
    wakes = 0
    while robot.moving:
        time.pass_until_woken(late_ns[wakes % len(late_ns)])
        wakes += 1
    return robot


async def run_stepped(program: list[Any]) -> ProgrammedRobot:
    robot, time = ProgrammedRobot(program), HandTime()
    clock = Clock(pace=STEPPED, now_ns=time.now, call_at=time.call_at)
    clock.start(robot)
    stopped = asyncio.ensure_future(clock.run_until_stopped(600.0))
    while not stopped.done():
        await asyncio.sleep(0)
        if time.asked_ns is not None:
            time.pass_until_woken()
    return robot


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(
    program=sequences(len(load_robot().joints), stops=True, longest=8),
    late_ns=st.lists(st.integers(0, 60 * MS_NS), min_size=1, max_size=5),
)
def test_a_program_has_the_same_motion_at_every_pace_despite_stalls(
    program: list[Any], late_ns: list[int]
) -> None:
    stepped = asyncio.run(run_stepped(program))
    for each in PACES:
        robot = paced(program, each, late_ns)
        assert robot.answers == stepped.answers
        ticks = min(len(robot.robot.joints), len(stepped.robot.joints))  # a wake-up may continue at rest
        assert ticks == len(stepped.robot.joints)
        assert robot.robot.joints[:ticks] == stepped.robot.joints, each
