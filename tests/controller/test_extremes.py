"""Numbers at the edges: the least and largest that there are, targets at limits, ways of almost nothing."""

from __future__ import annotations

import random
from collections.abc import Callable
from contextlib import suppress
from math import nextafter, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from tests.asked import (
    direct_joint_move,
    gravity_hold,
    joint_move,
    lin_force_move,
    lin_joint_move,
    lin_move,
    lin_move_at,
    lin_stiff_move,
    ptp_move,
    ptp_relative_move,
    ptp_stiff_move,
    smart_cartesian_move,
    smart_joint_move,
)
from tests.protocols.fake_robot import Conversation
from tests.stepped import ALL_ROBOTS, ROBOTS, SteppedRobot, assert_within_limits

TICKS = (0, 1, 2, 5, 30)
LEAST = (5e-324, 1e-310, 2.2e-308, 1e-200, 1e-20, 1e-9, nextafter(1e-6, 0.0), 1e-6, nextafter(1e-6, 1.0))
SPEEDS = (*LEAST, 1e-5, 1e-3, 0.5, nextafter(1.0, 0.0), 1.0, 1.0, 1.0)
WAYS = (0.0, *LEAST, 1e-12, 2e-8, 1e-7, 1e-5, 1e-3, 0.08, 0.5)
LARGE = (1e6, 1e9, 1e154, 1e300, 1e308, 1.7976931348623157e308)
OVERRIDES = (0.0, *LEAST, 0.5, nextafter(1.0, 0.0), 1.0, 1.0)
STIFFNESSES = (0.0, 5e-324, 1e-200, 1e-9, 1.0, 5000.0)


class Extremes:
    """One robot that is told moves with such numbers at any ticks."""

    def __init__(self, robot: str, seed: int) -> None:
        self._picks = random.Random(seed)
        self.robot = SteppedRobot(robot, self._picks.choice((0.001, 0.002, 0.01)))

    def run(self, commands: int) -> None:
        """Nothing but `Refused` is raised, and joints stay within their limits."""
        controller, picks = self.robot.controller, self._picks
        for _ in range(commands):
            with suppress(Refused):
                picks.choice(COMMANDS)(self, controller)
            self.robot.step(picks.choice(TICKS))
        controller.set_override(1.0)
        if picks.random() < 0.5:
            controller.stop()
        self.robot.step(60)
        d, joints = self.robot.description, np.array(self.robot.joints)
        assert np.isfinite(joints).all()
        assert (joints >= np.array(d.position_min) - 1e-9).all()
        assert (joints <= np.array(d.position_max) + 1e-9).all()
        speeds = np.abs(np.diff(joints, axis=0)) / self.robot.tick_s
        assert (speeds <= np.array(d.velocity) * (1.0 + 1e-9)).all()

    def one_of(self, *values: float) -> float:
        return self._picks.choice(values)

    def joints(self, near: float | None = None) -> list[float]:
        """At limits, or a way from where the robot is; joints of their own."""
        d, picks = self.robot.description, self._picks
        here = self.robot.controller.end_of_queue if near is None else self.robot.controller.joints
        at_limits = picks.random() < 0.2 and near is None
        joints = []
        for q, low, high in zip(here, d.position_min, d.position_max, strict=True):
            if at_limits and picks.random() < 0.5:
                joints.append(picks.choice((low, high, nextafter(low, high), nextafter(high, low))))
            else:
                way = picks.choice(WAYS) * picks.choice((-1.0, 1.0))
                if near is not None:
                    way = max(-near, min(near, way))
                joints.append(min(max(q + way, low), high))
        return joints

    def frame(self) -> Frame:
        picks = self._picks
        if picks.random() < 0.3:
            here = self.robot.controller.tool_frame()
            values = [value + picks.choice(WAYS) * picks.choice((-1.0, 1.0)) for value in here]
        else:
            values = list(self.robot.tcp_frame(self.joints()))
        if picks.random() < 0.15:
            values[picks.randrange(6)] = picks.choice((*LARGE, *LEAST, pi, -pi, 1e3)) * picks.choice((-1, 1))
        return Frame(*values)

    def speeds(self) -> list[float]:
        one = self._picks.choice(SPEEDS)
        mixed = self._picks.random() < 0.5
        return [self._picks.choice(SPEEDS) if mixed else one for _ in self.robot.controller.joints]

    def speed(self) -> float:
        return self._picks.choice(SPEEDS)

    def blending(self) -> float:
        return self._picks.choice((0.0, 5e-324, 1e-9, 1.0, 50.0, *LARGE))

    def force(self) -> list[float]:
        return [self._picks.choice((0.0, 0.0, *LEAST, 10.0, *LARGE)) for _ in range(6)]


COMMANDS: tuple[Callable[[Extremes, Controller], object], ...] = (
    *[lambda x, c: c.move(joint_move(x.joints(), x.speeds(), x.one_of(0.0, 5e-324, 0.1, 1.0)))] * 3,
    *[lambda x, c: c.move(lin_move(x.frame(), x.speed(), x.blending()))] * 2,
    lambda x, c: c.move(lin_move(x.frame(), x.speed(), x.blending(), x.one_of(0.0, *LEAST, *LARGE))),
    lambda x, c: c.move(lin_move_at(x.frame(), x.one_of(*SPEEDS, *LARGE), x.blending())),
    lambda x, c: c.move(lin_joint_move(x.joints(), x.speed(), x.blending())),
    *[lambda x, c: c.move(ptp_move(x.frame(), x.speed(), x.blending()))] * 2,
    lambda x, c: c.move(
        ptp_relative_move(Frame(*[x.one_of(*WAYS) for _ in range(6)]), 1.0, 1.0, in_tool=True)
    ),
    lambda x, c: c.move(lin_force_move(x.frame(), x.speed(), 0.0, (None, None, x.one_of(*LEAST, *LARGE)))),
    *[lambda x, c: c.move(lin_stiff_move(x.frame(), x.speed(), x.one_of(*STIFFNESSES), x.force()))] * 2,
    *[lambda x, c: c.move(ptp_stiff_move(x.frame(), x.speed(), x.one_of(*STIFFNESSES), x.force()))] * 2,
    lambda x, c: c.move(gravity_hold(x.one_of(*STIFFNESSES))),
    *[lambda x, c: c.move(smart_joint_move(x.joints(), x.speeds()))] * 3,
    lambda x, c: c.move(smart_cartesian_move(x.frame(), x.speed())),
    *[lambda x, c: c.move(direct_joint_move(x.joints(0.08), x.speeds()))] * 2,
    *[lambda x, c: c.set_override(x.one_of(*OVERRIDES))] * 3,
    lambda _, c: c.stop(),
    lambda _, c: c.cancel_move(),
    lambda _, c: c.clear_queue(),
)


@given(st.sampled_from(ROBOTS), st.integers(0, 2**32 - 1))
def test_extreme_numbers_are_refused_or_moved_to_and_raise_nothing(robot: str, seed: int) -> None:
    Extremes(robot, seed).run(12)


@pytest.mark.parametrize("speed", [0.0, 5e-324, 1e-200, 1e-20, nextafter(1e-6, 0.0)])
def test_speeds_below_a_millionth_are_refused(speed: float) -> None:
    controller: Controller = SteppedRobot().controller
    frame, joints = controller.tool_frame(), [*controller.joints[:6], controller.joints[6] + 0.002]
    for ask in (
        lambda: controller.move(joint_move(joints, [1.0] * 6 + [speed])),
        lambda: controller.move(lin_move(frame, speed, 0.0)),
        lambda: controller.move(ptp_move(frame, speed, 0.0)),
        lambda: controller.move(ptp_stiff_move(frame, speed, 100.0, [0.0] * 6)),
        lambda: controller.move(smart_joint_move(joints, [1.0] * 6 + [speed])),
        lambda: controller.move(direct_joint_move(joints, [1.0] * 6 + [speed])),
    ):
        with pytest.raises(Refused, match="1e-06"):
            ask()


JOINT_MOVES = {"joint": joint_move, "smart": smart_joint_move, "direct": direct_joint_move}


@pytest.mark.requirement("FRC004", "FRC010")
@pytest.mark.parametrize("kind", JOINT_MOVES)
@pytest.mark.parametrize("robot", ALL_ROBOTS)
@pytest.mark.parametrize("speed", [0.0, nextafter(1e-6, 0.0)])
def test_a_joint_near_its_target_accepts_any_speed(kind: str, robot: str, speed: float) -> None:
    """It slows no other, also where the robot was on its way."""
    slow, fast = SteppedRobot(robot), SteppedRobot(robot)
    for stepped, speeds in ((slow, speed), (fast, 1.0)):
        joints = list(stepped.controller.joints)
        first = [joints[0] + 0.07, *joints[1:]]
        then = [joints[0], joints[1] + 1e-3, joints[2] - 5e-4, *joints[3:]]
        rest = [speeds] * (len(joints) - 1)
        stepped.controller.move(JOINT_MOVES[kind](first, [0.5, *rest]))
        stepped.step(50)
        stepped.controller.move(JOINT_MOVES[kind](then, [0.5, *rest]))
    assert slow.runs_until_stopped() == fast.runs_until_stopped()
    assert slow.controller.joints == fast.controller.joints == tuple(then)
    assert_within_limits(slow)


@pytest.mark.parametrize("kind", ["smart", "direct"])
def test_a_joint_in_motion_accepts_a_low_speed_near_its_target(kind: str) -> None:
    """It may have to come back there, and then does so at once."""
    robot = SteppedRobot()
    joints = list(robot.controller.joints)
    robot.controller.move(JOINT_MOVES[kind]([joints[0] + 0.08, *joints[1:]], [1.0] * 7))
    robot.step(30)
    here = [robot.controller.joints[0] + 5e-4, *joints[1:]]
    robot.controller.move(JOINT_MOVES[kind](here, [1e-5] * 7))
    robot.runs_until_stopped(limit_s=2.0)
    assert robot.controller.joints == tuple(here)
    assert_within_limits(robot)


@pytest.mark.parametrize("override", [5e-324, 1e-307, 1e-12, nextafter(1e-6, 0.0)])
def test_overrides_below_a_millionth_are_refused_but_for_the_pause(override: float) -> None:
    robot = SteppedRobot()
    conversation = Conversation(robot.controller)
    assert conversation.ask(f"set override : {override!r}") == "error"
    assert robot.controller.override == 1.0
    for legal in (0.0, 1e-6):
        assert conversation.ask(f"set override : {legal!r}") == "done"


@pytest.mark.parametrize("robot", ALL_ROBOTS)
def test_a_joint_without_a_way_slows_no_other(robot: str) -> None:
    slow, fast = SteppedRobot(robot), SteppedRobot(robot)
    target = list(fast.controller.joints)
    target[0] += 0.3
    slow.controller.move(joint_move(target, [1.0] + [1e-6] * (len(target) - 1)))
    fast.controller.move(joint_move(target, [1.0] * len(target)))
    assert slow.runs_until_stopped() == fast.runs_until_stopped()
