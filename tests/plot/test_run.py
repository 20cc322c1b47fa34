"""A file of commands is what the stepped controller does with the same commands at the same ticks."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame
from iiwa_sim.plot.motion import REST_TICKS, PlotFault
from iiwa_sim.robot.description import load_robot
from tests.asked import joint_move, lin_move
from tests.plot.scripts import JOINT, JOINTS, KRC4_MOVES, LIN, moved


def test_states_are_those_of_the_controller_bit_for_bit() -> None:
    motion = moved(f"{LIN}\nwait 0.2\n{JOINT}\nwait stopped\nwait 0.1\n{LIN}\n", rate_hz=100)
    controller = Controller(load_robot("lbr_iiwa_7_r800"), 0.01)
    joints, places, speeds = [controller.joints], [controller.tool_frame()[:3]], [controller.joint_velocity()]

    def step() -> None:
        controller.step()
        joints.append(controller.joints)
        places.append(controller.tool_frame()[:3])
        speeds.append(controller.joint_velocity())

    def lin() -> None:
        controller.move(lin_move(Frame(450, 100, 520, 0, -1.57079, 0), 0.5, 20.0))

    lin()
    for _ in range(20):
        step()
    controller.move(joint_move([float(word) for word in JOINTS.split()], [1.0] * 7))
    while controller.moving:
        step()
    for _ in range(10):
        step()
    lin()
    while controller.moving:
        step()
    for _ in range(REST_TICKS):
        step()
    assert np.array_equal(motion.joints, np.array(joints))
    assert motion.tcp_mm == pytest.approx(np.array(places), abs=1e-4)
    assert motion.velocity == pytest.approx(np.array(speeds), abs=1e-7)
    assert motion.times_s[-1] == pytest.approx((len(joints) - 1) / 100)


@pytest.mark.parametrize(
    ("robot", "text", "names"),
    [
        ("lbr_iiwa_7_r800", f"get status\n{LIN}\nwait stopped\n{JOINT}", ["LIN 0.5 r20", "JOINT 1"]),
        ("lbr_iiwa_7_r800", "lin tool relative move : 0 0 10 0 0 0 0.25 0", ["LIN TOOL RELATIVE 0.25"]),
        ("kr_6_r900_sixx", KRC4_MOVES, ["LIN", "PTP"]),
    ],
)
def test_moves_have_names_and_end_at_their_goals(robot: str, text: str, names: list[str]) -> None:
    motion = moved(text, robot)
    assert [move.name for move in motion.moves] == names
    for move in motion.moves:
        assert move.end_s is not None
        assert motion.tcp_mm[round(500 * move.end_s)] == pytest.approx(move.goal_mm, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("hello\n\nlin move : 1 2", "line 3: 'lin move : 1 2': 3040 lin move takes x y z alpha"),
        (f"{LIN}\nbye\n{LIN}", f"line 3: '{LIN}': "),
        (f"wait 1 s\n{LIN}", "line 1: 'wait 1 s': expected 'wait SECONDS', 0 to 600, or 'wait stopped'"),
        ("protocol rsi\nhello", "expected iiwa or krc4"),
        ("protocol krc4\nCmd I1=999", "no command has the id 999"),
    ],
)
def test_what_cannot_be_run_names_file_line_command_and_reason(text: str, told: str) -> None:
    with pytest.raises(PlotFault) as caught:
        moved(text, rate_hz=100)
    assert "moves.txt: line " in str(caught.value)
    assert told in str(caught.value)
