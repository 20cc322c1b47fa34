"""A recording is what the stepped controller does with the same commands at the same ticks."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.plot.record import REST_TICKS, record
from iiwa_sim.plot.script import read_script
from iiwa_sim.robot.description import load_robot
from tests.asked import joint_move, lin_move
from tests.plot.scripts import EXAMPLE, JOINT, JOINTS, LIN, recorded

ROBOTS = ["lbr_iiwa_7_r800", "lbr_iiwa_14_r820"]


@pytest.mark.parametrize("rate_hz", [100, 500, 1000])
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_joints_are_those_of_the_controller_bit_for_bit(robot: str, rate_hz: int) -> None:
    recording = recorded(f"{LIN}\nwait 0.2\n{JOINT}\nwait stopped\nwait 0.1\n{LIN}\n", robot, rate_hz)
    controller = Controller(load_robot(robot), 1.0 / rate_hz)
    joints, places = [controller.joints], [controller.tool_frame()[:3]]

    def step() -> None:
        controller.step()
        joints.append(controller.joints)
        places.append(controller.tool_frame()[:3])

    def lin() -> None:
        controller.move(lin_move(Frame(450, 100, 520, 0, -1.57079, 0), 0.5, 20.0))

    lin()
    for _ in range(rate_hz // 5):
        step()
    controller.move(joint_move([float(word) for word in JOINTS.split()], [1.0] * 7))
    while controller.moving:
        step()
    for _ in range(rate_hz // 10):
        step()
    lin()
    while controller.moving:
        step()
    for _ in range(REST_TICKS):
        step()
    assert np.array_equal(recording.joints, np.array(joints))
    assert np.array_equal(recording.tcp_mm, np.array(places))
    assert recording.duration_s == pytest.approx((len(joints) - 1) / rate_hz)


def test_short_waits_do_not_add_up_what_ticks_round_off() -> None:
    recording = recorded("wait 0.0033\n" * 300, rate_hz=500)
    assert len(recording.joints) - 1 == round(0.0033 * 300 * 500) + REST_TICKS


def test_velocity_acceleration_and_tcp_speed_are_differences() -> None:
    recording = recorded(f"{JOINT}\n{LIN}")
    tick_s, q = recording.tick_s, recording.joints
    velocity = recording.velocity()
    assert len(velocity) == len(q) == len(recording.acceleration()) == len(recording.times_s())
    assert np.allclose(q[0] + np.cumsum(velocity, axis=0) * tick_s, q, atol=1e-12)
    assert np.allclose(np.cumsum(recording.acceleration(), axis=0) * tick_s, velocity, atol=1e-9)
    assert not velocity[0].any()
    assert not velocity[-1].any()
    assert not recording.acceleration()[-1].any()
    length_mm = np.linalg.norm(np.diff(recording.tcp_mm, axis=0), axis=1).sum()
    assert recording.tcp_speed_mm_s().sum() * tick_s == pytest.approx(length_mm)


@pytest.mark.parametrize("robot", ROBOTS)
def test_targets_are_where_their_moves_end(robot: str) -> None:
    recording = recorded(f"get status\n{LIN}\nwait stopped\n{JOINT}\n", robot)
    lin, joint = recording.targets
    assert (lin.line, lin.tcp_mm, lin.blending_mm, lin.mode) == (2, (450.0, 100.0, 520.0), 20.0, "normal")
    assert (joint.line, joint.blending_mm) == (4, 0.0)
    assert lin.done_tick is not None
    assert joint.done_tick is not None
    assert recording.tcp_mm[lin.done_tick] == pytest.approx(lin.tcp_mm)
    assert recording.tcp_mm[joint.done_tick] == pytest.approx(joint.tcp_mm)
    assert joint.done_tick == len(recording.joints) - 1 - REST_TICKS


def test_moves_that_a_stop_forgets_are_never_done() -> None:
    recording = recorded(f"{LIN}\n{JOINT}\nwait 0.1\nstop\nwait stopped\n{LIN}")
    assert [target.done_tick is not None for target in recording.targets] == [False, False, True]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "hello\n\nlin move : 1 2",
            "line 3: 'lin move : 1 2': error: lin move takes x y z alpha beta gamma speed blending: 8 val",
        ),
        ("lim move : 1", "line 1: 'lim move : 1': unknown command: no such command"),
        ("lin move : 2000 0 520 0 -1.57079 0 0.5 0", "error: the TCP at 2000.0"),
        (f"{LIN}\nbye\n{LIN}", f"line 3: '{LIN}': nothing is heard after bye"),
        ("wait 500\nwait 500", "line 2: 'wait 500': more than 600 s of simulated time"),
        (LIN.replace("0.5 20", "0.0001 20"), "more than 600 s of simulated time"),
        ("x" * 5000, "error: a line of more than 4096 bytes"),
        ("h\u00e9llo", "unknown command: no such command"),
    ],
)
def test_what_cannot_be_recorded_names_file_line_command_and_reason(text: str, told: str) -> None:
    with pytest.raises(PlotFault) as caught:
        recorded(text, rate_hz=20)
    message = str(caught.value)
    assert message.startswith("moves.txt: line ")
    assert told in message
    assert message.isprintable()
    assert len(message) <= 400


def test_the_example_runs_and_has_spheres_of_different_sizes() -> None:
    recording = record(read_script(str(EXAMPLE)), robot_alone(), 500)
    radii = [target.blending_mm for target in recording.targets]
    assert len({radius for radius in radii if radius > 0.0}) > 2
    assert all(target.done_tick is not None for target in recording.targets)
    assert not recording.velocity()[-1].any()
