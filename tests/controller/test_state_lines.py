"""Lines of recorded states, made many at a time, are those of the status port, rounded."""

from __future__ import annotations

import json

import msgspec
import numpy as np

from iiwa_sim.controller.numbers_kernel import Numbers
from iiwa_sim.controller.reading import Reading
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.controller.snapshot import snapshot
from iiwa_sim.controller.state_lines import StateLines
from iiwa_sim.robot.model import Model
from tests.asked import gravity_hold, joint_move, smart_joint_move
from tests.stepped import SteppedRobot

FULL = [1.0] * 7
FAR = (0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6)
STEPS = {
    "joint_velocity": [1e-7] * 7,
    "cartesian_force": [1e-4] * 6,
    "joint_torque": [1e-4] * 7,
    **dict.fromkeys(("flange_frame", "tool_frame", "goal_frame"), [1e-4] * 3 + [1e-7] * 3),
}


def eventful() -> tuple[list[Reading], list[bytes]]:
    """Readings of some seconds in which much happens, and what the status port tells of each tick."""
    robot = SteppedRobot()
    controller = robot.controller
    readings, lines = [], []
    read = controller.reader().read

    def steps(ticks: int) -> None:
        for _ in range(ticks):
            readings.append(read())
            lines.append(msgspec.json.encode(snapshot(controller)))
            robot.step()

    steps(3)
    controller.move(joint_move(FAR, FULL))
    steps(120)
    controller.set_override(0.0)
    steps(150)
    controller.set_override(1.0)
    controller.move(MoveRequest(Kind.PTP, (0.0,) * 7, speeds=FULL))
    steps(100)
    controller.load.wrench = (1.0 / 3.0, -2.0, 3.0, 0.1, 0.0, 0.0)
    controller.move(smart_joint_move(FAR, FULL))
    steps(200)
    controller.io.wire(3, True)
    controller.move(gravity_hold(300.0))
    steps(100)
    controller.emergency_stop()
    steps(60)
    return readings, lines


def test_every_line_is_that_of_the_status_port_rounded() -> None:
    readings, wanted = eventful()
    numbers = Numbers(Model(SteppedRobot().description).tcp_of_flange, rounded=True)
    maker = StateLines(numbers, 0.002, msgspec.UNSET)
    made = [maker.line(reading) for reading in readings]
    for line, told in zip(made, wanted, strict=True):
        state, expected = json.loads(line), json.loads(told)
        assert expected.pop("gripper") is None, "which is left out"
        for key, steps in STEPS.items():
            off = np.abs(np.subtract(state.pop(key), expected.pop(key)))
            assert (off <= 0.51 * np.array(steps)).all(), key
        assert state == expected, "bit for bit"
