"""Appendix A on the stepped core: commands, results, states and services."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iiwa_sim.controller.errors import EMERGENCY_STOP, STOP_TRIGGERED, SUCCESS
from iiwa_sim.controller.modes import Mode
from iiwa_sim.ros.messages import checked
from tests.requests import joint_move
from tests.ros_robot import RosRobot, command, ptp
from tests.stepped import assert_within_limits

A = (0.3, 0.3, 0.0, -1.2, 0.0, 1.0, 0.0)
B = (0.6, 0.5, 0.0, -1.2, 0.0, 1.0, 0.0)
C = (0.2, 0.7, 0.1, -1.0, 0.0, 1.0, 0.0)
STAMP = {"sec": 1_700_000_000, "nanosec": 250_000_000}
CANNOT = 3023  # joint limits


def lin(robot: RosRobot, identifier: int, joints: tuple[float, ...], **fields: Any) -> dict[str, Any]:
    """Return a LIN command to where the TCP is at joint positions."""
    x, y, z, *angles = robot.tcp_frame(joints)
    return command(identifier, "LIN", "EULER_INTRINSIC_ZYX", [x / 1e3, y / 1e3, z / 1e3, *angles], **fields)


@pytest.mark.requirement("FRA002", "FRA005", "FRC014")
def test_a_list_is_carried_out_in_order_with_a_result_each(robot: RosRobot) -> None:
    robot.gets(ptp(7, A), lin(robot, 8, B), ptp(9, C, velocity_type="RAD/S", velocity=[1.0]))
    robot.runs_until_results(3)
    assert robot.results == [(7, SUCCESS), (8, SUCCESS), (9, SUCCESS)]
    assert robot.controller.joints == pytest.approx(C)
    first = robot.messages["/command_result"][0]
    assert first["header"]["stamp"] == STAMP
    robot.step(100)
    assert len(robot.results) == 3
    assert_within_limits(robot)


@pytest.mark.requirement("FRC015")
@pytest.mark.parametrize(
    ("kind", "blending"),
    [
        ("PTP", {"blending_type": "%", "blending": [0.3]}),
        ("PTP", {"blending_type": "RAD", "blending": [0.1]}),
        ("LIN", {"blending_type": "M", "blending": [0.05]}),
        ("LIN", {"blending_type": "PERCENT", "blending": [30]}),
    ],
)
def test_moves_blend_as_requested(robot: RosRobot, kind: str, blending: dict[str, Any]) -> None:
    robot.goes_to(A)
    target = {"PTP": ptp, "LIN": lambda n, q, **f: lin(robot, n, q, **f)}[kind]
    robot.gets(target(1, B, **blending), target(2, C))
    robot.runs_until_results(2)
    assert robot.results == [(1, SUCCESS), (2, SUCCESS)]
    passes = min(np.abs(np.subtract(q, B)).max() for q in robot.joints)
    assert passes > 1e-4, "the corner is cut"
    still = [k for k in range(5, len(robot.joints)) if robot.joints[k] == robot.joints[k - 1]]
    assert min(still, default=len(robot.joints)) >= len(robot.joints) - 3, "without a stop"
    assert_within_limits(robot)


@pytest.mark.requirement("FRC021")
def test_an_unreachable_target_gets_its_code_after_the_moves_before_it(robot: RosRobot) -> None:
    robot.gets(ptp(1, A), ptp(2, (9.0, *A[1:])), ptp(3, B))
    robot.runs_until_results(3)
    assert robot.results == [(1, SUCCESS), (2, CANNOT), (3, CANNOT)]
    assert robot.words[1].startswith("A1 at 9 rad is outside")
    assert robot.words[2].startswith("not carried out, after command 2: A1 at 9 rad")
    assert robot.controller.joints == pytest.approx(A)
    assert robot.log.refusals == [("ros", "command 2", CANNOT, robot.words[1])], "one line, not one for each"


@pytest.mark.requirement("FRC013", "FRC016")
def test_a_replacing_list_stops_the_running_one(robot: RosRobot) -> None:
    robot.gets(ptp(1, B), ptp(2, A))
    robot.step(100)
    robot.gets(ptp(3, C), replace=True)
    assert robot.results == [(1, STOP_TRIGGERED), (2, STOP_TRIGGERED)]
    robot.runs_until_results(3)
    assert robot.results[2] == (3, SUCCESS)
    assert robot.controller.joints == pytest.approx(C)
    assert_within_limits(robot)


def test_smart_commands_wait_for_each_other_or_replace_each_other(robot: RosRobot) -> None:
    robot.goes_to(A)
    robot.gets(command(1, "SMART", "JOINTS", B), command(2, "SMART", "JOINTS", A))
    robot.runs_until_results(1)
    assert robot.controller.joints == pytest.approx(B)
    robot.runs_until_results(2)
    assert robot.controller.joints == pytest.approx(A)
    robot.gets(command(3, "SMART", "JOINTS", B))
    robot.step(50)
    speed = np.abs(robot.controller.joint_velocity()).max()
    robot.gets(command(4, "SMART", "JOINTS", C), replace=True)
    robot.step(2)
    assert np.abs(robot.controller.joint_velocity()).max() > 0.5 * speed, "without a stop"
    robot.runs_until_results(4)
    assert robot.results == [(1, SUCCESS), (2, SUCCESS), (3, STOP_TRIGGERED), (4, SUCCESS)]
    assert robot.controller.mode is Mode.SMART


@pytest.mark.parametrize("kind", ["LINFORCE", "PTPFORCE"])
def test_a_force_move_succeeds_at_a_contact_and_the_list_continues(robot: RosRobot, kind: str) -> None:
    robot.goes_to(A)
    x, y, z, *angles = robot.tcp_frame(A)
    down = [x / 1e3, y / 1e3, z / 1e3 - 0.2, *angles]
    forces = {"effort_type": "N", "effort": [5.0, 5.0, 5.0], "velocity": [0.1]}
    robot.gets(command(1, kind, "EULER_INTRINSIC_ZYX", down, **forces), ptp(2, A))
    robot.step(200)
    robot.controller.load.wrench = (0.0, 0.0, -8.0, 0.0, 0.0, 0.0)
    robot.runs_until_results(1)
    assert robot.results == [(1, SUCCESS)]
    assert "force of -8.000 N along z of the TCP" in robot.words[0]
    assert robot.controller.tool_frame().z_mm > z - 150.0
    robot.runs_until_results(2)
    assert robot.controller.joints == pytest.approx(A)


def test_an_emergency_stop_ends_all_commands_and_rejects_new_ones(robot: RosRobot) -> None:
    robot.gets(ptp(1, A), ptp(2, B), command(3, "SMART", "JOINTS", C))
    robot.step(50)
    robot.controller.emergency_stop()
    robot.step()
    assert robot.results == [(1, EMERGENCY_STOP), (2, EMERGENCY_STOP), (3, EMERGENCY_STOP)]
    robot.gets(ptp(4, A))
    robot.step()
    assert robot.results[3] == (4, EMERGENCY_STOP)
    assert "no move before reset error" in robot.words[3]


@pytest.mark.requirement("FRC017", "FRA007")
def test_the_states_of_the_robot_at_their_rates(robot: RosRobot) -> None:
    published = {name: topic for name, topic in robot.graph.published.items() if topic.rate_hz}
    messages = {name: robot.subscribes(name) for name in published}
    robot.controller.move(joint_move(B, [0.5] * 7))
    robot.controller.io.set_output(2, True)
    robot.step(500)
    for name, topic in published.items():
        assert len(messages[name]) == topic.rate_hz, name
        if topic.in_ros1:
            checked(messages[name][-1], topic.kind)
    joints = messages["/joint_states"][50]
    assert joints["name"] == ["A1", "A2", "A3", "A4", "A5", "A6", "A7"]
    place = robot.joints.index(tuple(joints["position"]))
    assert joints["velocity"] == pytest.approx(
        np.subtract(robot.joints[place], robot.joints[place - 1]) / robot.tick_s
    )
    frame = messages["/tool_frame"][-1]
    expected = robot.controller.tool_frame()
    assert [frame[name] for name in ("x", "y", "z")] == pytest.approx([v / 1e3 for v in expected[:3]])
    assert [frame[name] for name in ("alpha", "beta", "gamma")] == pytest.approx(expected[3:])
    status = messages["/robot_status"][10]
    assert status["mode"]["val"] == 2
    assert status["in_motion"]["val"] == 1
    assert messages["/robot_status"][-1]["in_motion"]["val"] == 0
    assert status["header"]["stamp"] == STAMP
    assert messages["/current_speed_scale"][-1] == {"data": 1.0}
    states = messages["/io_states"][-1]
    assert states["outputs"][1] == {"pin_number": 2, "pin_value": True}
    assert [pin["pin_number"] for pin in states["inputs"]] == list(range(17, 33))


@pytest.mark.requirement("FRC025")
@pytest.mark.parametrize(("value", "scale"), [(0.5, 0.5), (-0.1, 0.01), (1.5, 1.0)])
def test_scale_speed_limits_its_value(robot: RosRobot, value: float, scale: float) -> None:
    assert robot.calls("/scale_speed", value=value) == {}
    assert robot.controller.override == scale


def test_scale_speed_0_stops_and_cancels_and_pauses_new_commands(robot: RosRobot) -> None:
    robot.gets(ptp(1, A), ptp(2, B))
    robot.step(60)
    robot.notice_mode()
    assert robot.calls("/scale_speed", value=0.0) == {}
    assert robot.results == [(1, STOP_TRIGGERED), (2, STOP_TRIGGERED)]
    assert "scale_speed 0" in robot.words[0]
    assert robot.runs_until_stopped() < 60
    rests = robot.controller.joints
    robot.gets(ptp(3, A))
    robot.step(100)
    assert robot.controller.joints == rests
    assert robot.calls("/scale_speed", value=1.0) == {}
    robot.runs_until_results(3)
    assert robot.results[2] == (3, SUCCESS)


@pytest.mark.requirement("FRC003")
def test_stop_robot_right_now(robot: RosRobot) -> None:
    robot.gets(ptp(1, A), command(2, "SMART", "JOINTS", B))
    robot.step(60)
    assert robot.calls("/stop_robot_right_now") == {"success": True, "message": ""}
    assert robot.results == [(1, STOP_TRIGGERED), (2, STOP_TRIGGERED)]
    assert robot.runs_until_stopped() < 60
    robot.gets(ptp(3, A))
    robot.runs_until_results(3)
    assert robot.results[2] == (3, SUCCESS)


@pytest.mark.requirement("FRC022", "FRC023")
def test_outputs_are_numbered_first_then_inputs(robot: RosRobot) -> None:
    assert robot.calls("/set_io", number=5, value=True) == {"error": 0}
    assert robot.controller.io.output(5)
    assert robot.calls("/get_io", number=5) == {"value": True, "error": 0}
    robot.controller.io.wire(3, True)
    assert robot.calls("/get_io", number=19) == {"value": True, "error": 0}
    assert robot.calls("/get_io", number=18) == {"value": False, "error": 0}


@pytest.mark.requirement("FRC024")
def test_digital_ios_of_anyrobot(robot: RosRobot) -> None:
    on = [{"id": {"group_id": "DO", "pin_number": n}, "value": True} for n in (3, 4)]
    assert robot.calls("/robot/set_digital_ios", ios=on) == {"success": True, "errors": []}
    answer = robot.calls("/robot/get_digital_ios")
    assert (answer["success"], answer["errors"]) == (True, [])
    assert len(answer["ios"]) == 32
    assert [{"id": pin["id"], "value": True} for pin in answer["ios"] if pin["value"]] == on
    one = robot.calls("/robot/get_digital_ios", ios=[{"group_id": "DI", "pin_number": 16}])
    (pin,) = one["ios"]
    assert pin == {
        "id": {"group_id": "DI", "pin_number": 16},
        "value": False,
        "stamp": STAMP,
    }
