"""The snapshot of a robot that moves."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.controller.state import ErrorState, Snapshot, snapshot
from tests.asked import joint_move
from tests.states import SCHEMA
from tests.stepped import SteppedRobot

FAR = ((1.0, 1.0, 1.0, -1.5, 1.0, 1.0, 1.0), (0.3,) * 7)


def test_the_schema_describes_every_field_and_no_other() -> None:
    for struct, schema in (
        (Snapshot, SCHEMA),
        (ErrorState, SCHEMA["properties"]["error"]),
    ):
        assert list(schema["properties"]) == schema["required"] == [*struct.__struct_fields__]


@pytest.mark.requirement("FRA007", "FRC017", "FRC018")
def test_it_holds_what_the_controller_says_at_every_tick() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.load.wrench = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    controller.move(joint_move(*FAR))
    while controller.moving:
        robot.step(50)
        seen = snapshot(controller)
        assert seen.tick == controller.tick
        assert seen.time_s == pytest.approx(controller.tick * robot.tick_s)
        assert seen.mode == "normal"
        assert seen.status == ("moving" if controller.moving else "stopped")
        assert seen.joint_position == controller.joints
        assert seen.flange_frame == controller.flange_frame()
        assert seen.tool_frame == controller.tool_frame()
        assert seen.cartesian_force == (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
        assert seen.joint_torque == controller.joint_torque()
    assert snapshot(controller).status == "stopped"


@pytest.mark.parametrize("tick_s", [0.001, 0.01])
def test_velocities_add_up_to_the_way(tick_s: float) -> None:
    robot = SteppedRobot(tick_s=tick_s)
    velocities = [robot.controller.joint_velocity()]
    assert velocities == [(0.0,) * 7]
    robot.controller.move(joint_move(*FAR))
    while robot.controller.moving:
        robot.step()
        velocities.append(robot.controller.joint_velocity())
    robot.step()
    assert robot.controller.joint_velocity() == (0.0,) * 7
    way = np.sum(velocities, axis=0) * tick_s
    assert way == pytest.approx(np.subtract(robot.controller.joints, robot.joints[0]), abs=1e-12)
    assert np.max(np.abs(velocities), axis=0)[0] > 0.05


def test_time_is_told_as_one_writes_it() -> None:
    robot = SteppedRobot()
    robot.step(51)
    assert snapshot(robot.controller).time_s == 0.102
