"""How drive and servo take turns, and what becomes of the one that waits when the other fails."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.controller.motions import Motions
from iiwa_sim.controller.wanted import Target
from iiwa_sim.motion.even_kernel import EvenTicks, GivesWay
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.nominal import Nominal
from iiwa_sim.motion.override import Override

Joints = tuple[float, ...]
HERE, THERE, FAR = (0.0,), (1.0,), (2.0,)
LIMITS = JointLimits(np.ones(1), np.ones(1), np.ones(1))
STOP_TICKS = 3


class Motion(EvenTicks):
    """A drive and a servo in one that goes where it is told in two ticks, and stops in STOP_TICKS."""

    under_way = False

    def __init__(self) -> None:
        self._ahead = []  # no tick is known before it is made
        self.joints: Joints = HERE
        self.goals: list[Joints] = []
        self.left = 0  # ticks of a stop
        self.fails = False
        self.running = None

    @property
    def moving(self) -> bool:
        return bool(self.goals) or self.left > 0

    @property
    def stopping(self) -> bool:
        return self.left > 0

    @property
    def waiting(self) -> int:
        return len(self.goals)

    @property
    def rest(self) -> Joints:
        return self.goals[-1] if self.goals else self.rest_after_stop()

    def rest_after_stop(self) -> Joints:
        return (self.joints[0] + 0.01,) if self.left else self.joints

    def is_pending(self, _: int) -> bool:
        return False  # it knows of no numbers

    def append(self, goal: Joints) -> None:
        self.goals.append(goal)

    def head_for(self, goal: Joints, limits: JointLimits) -> None:
        assert limits is LIMITS
        assert not self.left, "under way to a stop"
        if self.fails:
            raise ArithmeticError
        self.goals = [goal]

    def stop(self) -> None:
        if self.under_way:
            self.under_way = False
            self.left = STOP_TICKS
        self.goals = []

    def start_from(self, joints: Joints) -> None:
        assert not self.moving
        self.joints = joints

    def step(self) -> None:
        if self.fails:
            self.goals, self.left, self.under_way = [], 0, False
            raise ArithmeticError
        if self.left:
            self.left -= 1
            if not self.left:
                self.joints = (self.joints[0] + 0.01,)
        elif self.under_way:
            self.under_way = False
            self.joints = self.goals.pop(0)
        elif self.goals:
            self.under_way = True


class Stiff(GivesWay):
    """A follower that is never started."""

    active = yielding = holding = braking = moving = off_plan = False

    def stop(self) -> None:
        pass


def pair() -> tuple[Motion, Motion, Motions]:
    drive, servo, override = Motion(), Motion(), Override(0.002, LIMITS)
    return drive, servo, Motions(Nominal(drive, servo, override), Stiff(), override)


def runs_until_stopped(motions: Motions) -> int:
    ticks = 0
    while motions.moving:
        motions.step()
        ticks += 1
        assert ticks < 100
    return ticks


def test_each_starts_where_the_other_has_come_to_rest() -> None:
    drive, servo, motions = pair()
    motions.head_for(Target(1, THERE, LIMITS))
    motions.step()
    motions.stop()
    motions.append(HERE)
    motions.append(THERE)
    assert drive.joints == servo.rest_after_stop(), "known before it has come to rest"
    for _ in range(STOP_TICKS):
        motions.step()
    assert motions.joints == drive.joints == (0.01,)
    assert runs_until_stopped(motions) == 4
    assert motions.joints == THERE
    motions.append(FAR)
    motions.step()
    motions.stop()
    motions.head_for(Target(3, HERE, LIMITS))
    runs_until_stopped(motions)
    assert motions.joints == HERE


def test_where_the_active_motion_fails_what_waits_is_forgotten() -> None:
    drive, servo, motions = pair()
    motions.append(THERE)
    motions.step()
    motions.stop()
    motions.head_for(Target(1, FAR, LIMITS))
    drive.fails = True
    with pytest.raises(ArithmeticError):
        motions.step()
    assert not motions.moving
    assert not motions.is_pending(1)
    drive.fails = False
    motions.head_for(Target(2, THERE, LIMITS))
    runs_until_stopped(motions)
    motions.head_for(Target(3, FAR, LIMITS))
    motions.step()
    motions.stop()
    motions.append(HERE)
    servo.fails = True
    with pytest.raises(ArithmeticError):
        motions.step()
    assert not motions.moving
    runs_until_stopped(motions)
    assert motions.joints == THERE


def test_a_servo_that_finds_no_way_when_its_turn_comes_may_be_sent_elsewhere() -> None:
    _, servo, motions = pair()
    motions.head_for(Target(1, THERE, LIMITS))
    servo.fails = True
    with pytest.raises(ArithmeticError):
        motions.step()
    assert not motions.moving
    assert not motions.is_pending(1)
    servo.fails = False
    motions.head_for(Target(2, FAR, LIMITS))
    runs_until_stopped(motions)
    assert motions.joints == FAR
