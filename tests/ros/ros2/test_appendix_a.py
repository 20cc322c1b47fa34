"""Appendix A on the node of ROS 2, asked by a user's node with robot_movement_interface."""

from __future__ import annotations

from math import nan

from iiwa_sim.simulator import Simulator
from tests.ros.ros2.users import AWAY, User
from tests.ros_robot import command, ptp

RMI = "robot_movement_interface"


def test_commands_end_with_their_results(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    someone.asks("hear", topic="command_result", kind=f"{RMI}/msg/Result")
    results = {}
    for asked in (ptp(1, AWAY), ptp(2, [99.0] * 7), command(3, "PTP", "JOINTS", [nan] * 7)):
        listed = {"commands": [asked], "replace_previous_commands": True}
        someone.asks("publish", topic="command_list", kind=f"{RMI}/msg/CommandList", messages=[listed])
        (told,) = someone.asks("wait", topic="command_result", count=1)["messages"]
        results[told["command_id"]] = (told["result_code"], told["additional_information"])
    assert results[1] == (0, "")
    assert results[2][0] == 3023
    assert results[3][0] == 3000
    assert "finite" in results[3][1]
    assert [round(each, 6) for each in robot.joints] == list(AWAY)
    status = someone.hears("robot_status", "industrial_msgs/msg/RobotStatus", 1)[-1]
    assert (status["drives_powered"], status["in_error"]) == ({"val": 1}, {"val": 0})


def test_override_inputs_and_outputs(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    assert someone.calls("scale_speed", f"{RMI}/srv/SetFloat", value=0.25) is not None
    assert robot.controller.override == 0.25
    assert someone.calls("set_io", f"{RMI}/srv/SetIO", number=2, value=True) == {"error": 0}
    assert someone.calls("get_io", f"{RMI}/srv/GetIO", number=2) == {"value": True, "error": 0}
    assert someone.calls("set_io", f"{RMI}/srv/SetIO", number=99, value=True)["error"] != 0
    states = someone.calls("robot/get_digital_ios", f"{RMI}/srv/GetDigitalIOs", ios=[])
    assert states["success"]
    assert [each["value"] for each in states["ios"] if each["id"] == {"group_id": "DO", "pin_number": 2}] == [
        True
    ]
    # A call that fails is answered, since ROS 2 has no other way; the robot goes on as before.
    someone.calls("scale_speed", f"{RMI}/srv/SetFloat", value=nan)
    assert robot.controller.override == 0.25
    assert someone.calls("stop_robot_right_now", "std_srvs/srv/Trigger") == {"success": True, "message": ""}
