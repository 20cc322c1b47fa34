"""The action FollowJointTrajectory on the node of ROS 2, asked by a user's node with control_msgs."""

from __future__ import annotations

import json

import pytest
from websockets.sync.client import connect

from iiwa_sim.ros.rosbridge.ros2 import CANCEL_SERVICE
from iiwa_sim.simulator import Simulator
from tests.ros.ros2.users import AWAY, HERE, User
from tests.talking import DEADLINE_S


def test_goals_end_as_those_of_joint_trajectory_controller(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    assert someone.sends("reached", [(2.0, AWAY), (4.0, HERE)])
    end = someone.asks("result", name="reached")
    assert (end["status"], end["result"]) == (4, {"error_code": 0, "error_string": ""})
    assert [round(each, 6) for each in robot.joints] == [round(each, 6) for each in HERE]
    # Feedback is 20 times in a second of simulated time; what is not read in time is left out.
    assert 1 <= len(end["feedback"]) <= 81
    first = end["feedback"][0]
    assert first["joint_names"] == [f"A{k}" for k in range(1, 8)]
    there = zip(first["desired"]["positions"], first["actual"]["positions"], strict=True)
    assert [a - b for a, b in there] == pytest.approx(first["error"]["positions"], abs=1e-12)

    # Cancelled: an hour's way, so that no slow machine is at its end before.
    assert someone.sends("cancelled", [(3600.0, AWAY)])
    someone.asks("feedback", name="cancelled", count=1)
    assert someone.asks("cancel", name="cancelled") == {"code": 0, "canceling": 1}
    end = someone.asks("result", name="cancelled")
    assert (end["status"], end["result"]["error_code"]) == (5, 0)
    assert someone.asks("cancel", name="cancelled")["canceling"] == 0, "it has ended"

    # Preempted by a newer one, and that by the service.
    assert someone.sends("old", [(3600.0, AWAY)])
    assert someone.sends("new", [(3600.0, AWAY)])
    end = someone.asks("result", name="old")
    assert (end["status"], end["result"]["error_code"]) == (6, -1)
    assert end["result"]["error_string"] == "preempted by a newer trajectory"
    assert someone.calls("stop", "std_srvs/srv/Trigger")["success"]
    assert someone.asks("result", name="new")["result"]["error_code"] == -1


def test_a_goal_that_another_client_cancels_is_aborted(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    assert someone.sends("mine", [(3600.0, AWAY)])
    with connect(f"ws://127.0.0.1:{robot.rosbridge_port}") as other:
        other.send(json.dumps({"op": "call_service", "service": CANCEL_SERVICE}))
        other.recv(DEADLINE_S)
    end = someone.asks("result", name="mine")
    assert (end["status"], end["result"]) == (6, {"error_code": -1, "error_string": "cancelled"})
