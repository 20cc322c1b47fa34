"""Lines of recorded states, made many at a time, are those of the status port, rounded."""

from __future__ import annotations

import json
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.reading import Reading
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.dialect.status import status_line
from iiwa_sim.frames import Frame, Transform, transform_from_euler
from iiwa_sim.recordings.state import StateLines, _frames
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
ANGLE = st.one_of(st.floats(-pi, pi), st.sampled_from([0.0, -0.0, 0.5 * pi, -0.5 * pi, pi, -pi]))


def eventful() -> tuple[list[Reading], list[bytes]]:
    """Readings of some seconds in which much happens, and what the status port tells of each tick."""
    robot = SteppedRobot()
    controller = robot.controller
    readings, lines = [], []

    def steps(ticks: int) -> None:
        for _ in range(ticks):
            readings.append(controller.reading())
            lines.append(status_line(controller))
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


@pytest.mark.parametrize("at_once", [1, 7, 1000])
def test_every_line_is_that_of_the_status_port_rounded(at_once: int) -> None:
    readings, wanted = eventful()
    maker = StateLines(SteppedRobot().description, 0.002)
    made: list[bytes] = []
    for begins in range(0, len(readings), at_once):
        made += maker.lines(readings[begins : begins + at_once])
    for line, told in zip(made, wanted, strict=True):
        state, expected = json.loads(line), json.loads(told)
        assert expected.pop("gripper") is None, "which is left out"
        for key, steps in STEPS.items():
            for value, exact, step in zip(state.pop(key), expected.pop(key), steps, strict=True):
                assert value == pytest.approx(exact, abs=0.51 * step, rel=0.0), key
        assert state == expected, "bit for bit"


@given(st.lists(st.tuples(ANGLE, ANGLE, ANGLE), min_size=1, max_size=5))
def test_frames_are_found_as_one_by_one(angles: list[tuple[float, float, float]]) -> None:
    poses = [transform_from_euler(0.1 * place, -4.0, 0.3, *turn) for place, turn in enumerate(angles)]
    found = _frames(poses)
    for pose, row in zip(poses, found.tolist(), strict=True):
        wanted: Transform = Frame.from_transform(pose).to_transform()
        there = Frame(*row).to_transform()
        assert np.allclose(there.rotation, wanted.rotation, atol=3e-7)
        assert np.allclose(there.translation, wanted.translation, atol=1e-7)
