"""What a protective stop leaves beyond a limit may stay so, and grow by 2 %, as long as it is there."""

from __future__ import annotations

import pytest

from tests.stepped import SteppedRobot

NO_WRENCH = (0.0,) * 6
LIMIT_A4, LIMIT_A7 = 110.0, 40.0


def on_joints(a4: float, a7: float = 0.0) -> tuple[float, ...]:
    return (0.0, 0.0, 0.0, a4, 0.0, 0.0, a7)


def passes(robot: SteppedRobot, ticks: int = 5) -> None:
    """As a clock lets time pass: a robot at rest makes no ticks."""
    for _ in range(ticks):
        if robot.controller.resting:
            robot.controller.skip(1)
        else:
            robot.step()


def stopped_by(torques: tuple[float, ...]) -> SteppedRobot:
    """The robot stands there, pushed like that, after the reset."""
    robot = SteppedRobot()
    robot.controller.load.joint_push = torques
    passes(robot)
    robot.controller.reset_error()
    passes(robot)
    assert len(robot.faults) == 1
    return robot


@pytest.mark.parametrize("reset_first", [False, True])
@pytest.mark.parametrize("what", ["wrench", "joint_push"])
def test_a_push_as_great_as_the_one_before_is_detected_in_the_next_tick(what: str, reset_first: bool) -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.set_collision_detection(50.0, 0.0)
    push, nothing = {
        "wrench": ((90.0, 0.0, 0.0, 0.0, 0.0, 0.0), NO_WRENCH),
        "joint_push": (on_joints(1.3 * LIMIT_A4), on_joints(0.0)),
    }[what]
    for times in range(1, 4):
        setattr(controller.load, what, push)
        passes(robot, 1)
        assert len(robot.faults) == times
        passes(robot)
        for resets in (reset_first, not reset_first):
            if resets:
                controller.reset_error()
            else:
                setattr(controller.load, what, nothing)
            passes(robot)
        assert controller.resting


def test_detection_that_is_set_anew_allows_nothing() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.set_collision_detection(50.0, 0.0)
    controller.load.wrench = (90.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    passes(robot)
    controller.reset_error()
    passes(robot)
    assert len(robot.faults) == 1
    controller.set_collision_detection(50.0, 0.0)
    passes(robot, 1)
    assert len(robot.faults) == 2


@pytest.mark.parametrize(("a4", "stops"), [(111.0, False), (111.019, False), (111.021, True)])
def test_of_a_torque_the_excess_may_grow_by_2_percent(a4: float, stops: bool) -> None:
    robot = stopped_by(on_joints(111.0))
    robot.controller.load.joint_push = on_joints(a4)
    passes(robot)
    assert bool(robot.faults[1:]) == stops


def test_what_is_allowed_on_one_joint_is_not_on_another() -> None:
    robot = stopped_by(on_joints(150.0))
    robot.controller.load.joint_push = on_joints(150.0, 0.999 * LIMIT_A7)
    passes(robot)
    assert len(robot.faults) == 1
    robot.controller.load.joint_push = on_joints(150.0, 1.001 * LIMIT_A7)
    passes(robot, 1)
    assert len(robot.faults) == 2
    assert "on A7 is 40.0 Nm, its limit is 40 Nm" in robot.faults[1][1]
