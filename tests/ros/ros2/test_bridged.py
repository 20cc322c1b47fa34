"""`iiwa-sim bridge --ros2`: any robot of the text protocol as a node of ROS 2, in processes of their own."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from iiwa_sim.simulator import Simulator
from tests.processes import IIWA_SIM, started
from tests.ros.ros2.users import CELL, HERE, NAMES, user

SET_BOOL, TRIGGER = "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"

MOST_STATES = 2_000
"""In which the robot is there: it takes 0.03 s."""


@pytest.mark.slow
def test_a_robot_behind_a_bridge_is_a_node(whole_python: Path) -> None:
    options = ["--rosbridge-port", "0", "--ros2", "--ros2-python", whole_python, "--ros-namespace", CELL]
    with Simulator(clock="10x") as robot:
        program = [*IIWA_SIM, "bridge", f"127.0.0.1:{robot.port}", *options]
        with started(*program) as bridge, user(whole_python) as someone:
            assert bridge.line().startswith("rosbridge on ")
            assert bridge.line() == f"ROS 2 node /{CELL}/iiwa_sim\n"
            kind = "sensor_msgs/msg/JointState"
            someone.asks("hear", topic="joint_states", kind=kind)
            state = someone.asks("wait", topic="joint_states", count=2)["messages"][-1]
            assert (state["name"], state["velocity"]) == (NAMES, [])
            assert state["position"] == pytest.approx(HERE, abs=1e-6)
            near = [HERE[0] + 0.05, *HERE[1:]]
            told = {"name": NAMES, "position": near}
            someone.asks("publish", topic="robot_joint_commands", kind=kind, messages=[told])
            assert someone.calls("set_output_1", SET_BOOL, data=True) == {"success": True, "message": ""}
            assert robot.controller.io.outputs[0]
            assert not someone.sends("none", [(1.0, HERE)]), "the text protocol has no trajectories"
            assert not someone.calls("emergency_stop", SET_BOOL, data=True)["success"]
            for _ in range(MOST_STATES):
                someone.asks("wait", topic="joint_states", count=1)
                if robot.joints == pytest.approx(near, abs=1e-6):
                    break
            assert robot.joints == pytest.approx(near, abs=1e-6)
            assert someone.calls("stop", TRIGGER)["success"]
            code, said = bridge.ends(signal.SIGTERM)
    assert code == 0, said
    assert "a robot behind a bridge follows no trajectories: the text protocol has none" in said
