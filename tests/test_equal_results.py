"""The topics and services of Appendix A give the same results over rosbridge in the words of ROS 1 and of ROS
2, and over the bytes of ROS 1.

The numbers sent have no more digits than a float32 holds: nodes round to it, JSON does not.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple, Protocol

import msgspec
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.ros.rmi.definitions import message, service, type_of
from iiwa_sim.ros.rmi.message_text import Definition
from iiwa_sim.ros.rmi.node import SUBSCRIBED
from iiwa_sim.ros.rmi.serialized import deserialized, serialized
from iiwa_sim.ros.rosbridge.outbox import Outbox
from iiwa_sim.ros.rosbridge.rosapi import RosApi
from iiwa_sim.ros.rosbridge.session import RosbridgeSession
from tests.ros_robot import RosRobot, command

HOME = [0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0]
HOME_POSE = [0.5, 0.0, 0.4, 0.0, 1.5, 0.0]  # m, rad
COMMAND_LIST, RESULTS, STATES = "/command_list", "/command_result", "/joint_states"
LONGEST_S = 120.0
"""Simulated time in which every list has its results."""


def _float32(value: float) -> float:
    """The shortest decimal that float32 does not tell from it, as ROS 1's bytes are read here."""
    return float(str(np.float32(value)))


def _near(places: list[float], by: float) -> st.SearchStrategy[list[float]]:
    away = st.floats(-by, by)
    return st.tuples(*(away for _ in places)).map(
        lambda found: [_float32(place + each) for place, each in zip(places, found, strict=True)]
    )


SPEEDS = [("%", [0.5]), ("%", [1.0]), ("PERCENT", [25.0])]
WRONG = st.sampled_from(
    [
        {"command_type": "CIRC"},
        {"velocity": []},
        {"velocity": [2.0]},
        {"velocity_type": "KNOTS"},
        {"pose": [0.25, 0.5]},
        {"pose": [3.5] * 7},
        {"pose_type": "POLAR"},
        {"blending_type": "%", "blending": [1.5]},
        {"effort": [1.0]},
        {"additional_values": [1.0]},
        {"acceleration_type": "M/S^2", "acceleration": [0.5]},
    ]
)
BLENDINGS = st.sampled_from([{}, {}, {"blending_type": "%", "blending": [0.25]}])
CAPS = st.sampled_from([{}, {}, {"acceleration_type": "%", "acceleration": [0.5]}])


@st.composite
def commands(draw: st.DrawFn) -> dict[str, Any]:
    """Mostly right ones."""
    kind = draw(st.sampled_from(["PTP", "PTP", "LIN", "LIN", "DIRECT", "SMART"]))
    identifier, speeds, more = draw(st.integers(0, 2**32 - 1)), SPEEDS, {}
    if kind in ("PTP", "DIRECT") or draw(st.integers(0, 3)) == 0:
        told = command(identifier, kind, "JOINTS", draw(_near(HOME, 0.05 if kind == "DIRECT" else 0.4)))
        speeds = speeds if kind == "LIN" else [*speeds, ("RAD/S", [0.5])]
    else:
        told = command(identifier, kind, "EULER_INTRINSIC_ZYX", draw(_near(HOME_POSE, 0.1)))
        speeds = [*speeds, ("M/S", [0.25])] if kind == "LIN" else speeds
    if kind in ("PTP", "LIN"):
        more = draw(BLENDINGS) | draw(CAPS)
    velocity_type, velocity = draw(st.sampled_from(speeds))
    told |= {"velocity_type": velocity_type, "velocity": velocity, **more}
    if draw(st.integers(0, 9)) == 0:
        told |= draw(WRONG)
    if draw(st.integers(0, 9)) == 0:
        told |= {"pose_reference": "/tool", "pose_reference_frame": {"x": 0.125}}
    return told


lists = st.lists(commands(), max_size=3)
calls = st.sampled_from(
    [
        ("/scale_speed", {"value": 0.5}),
        ("/scale_speed", {"value": -1.0}),
        ("/scale_speed", {"value": 0.0}),
        ("/scale_speed", {"value": 1.0}),
        ("/stop_robot_right_now", {}),
        ("/set_io", {"number": 3, "value": True}),
        ("/set_io", {"number": 40, "value": True}),
        ("/get_io", {"number": 3}),
        ("/robot/set_digital_ios", {"ios": [{"id": {"group_id": "DO", "pin_number": 2}, "value": True}]}),
        ("/robot/get_digital_ios", {"ios": [{"group_id": "DO", "pin_number": 2}, {"group_id": "XX"}]}),
    ]
)


class Said(NamedTuple):
    """What a client does, and how many ticks then pass."""

    list: list[dict[str, Any]] | None
    replace: bool
    call: tuple[str, dict[str, Any]] | None
    ticks: int


dialogues = st.lists(
    st.builds(Said, st.none() | lists, st.booleans(), st.none() | calls, st.integers(0, 200)),
    min_size=1,
    max_size=3,
)


class Front(Protocol):
    """One way in to a robot."""

    robot: RosRobot

    def sends(self, told: list[dict[str, Any]], replace: bool) -> None:
        """Publish a list of commands."""

    def calls(self, name: str, request: dict[str, Any]) -> Any:
        """The response, in the words of ROS 1."""

    def results(self) -> list[tuple[int, int, str]]:
        """All that have come by now."""


class Rosbridge:
    """By JSON, in the words of ROS 1 or of ROS 2."""

    def __init__(self, *, ros2: bool) -> None:
        self.robot = RosRobot()
        self._ros2 = ros2
        self._outbox = Outbox(lambda: None)
        api = RosApi(self.robot.node)
        self._session = RosbridgeSession(self.robot.graph, api, self._outbox, self.robot.log, "test")
        self._results: list[tuple[int, int, str]] = []
        self._says("subscribe", topic=RESULTS, type=self._named("Result"))
        self._says("advertise", topic=COMMAND_LIST, type=self._named("CommandList"))

    def sends(self, told: list[dict[str, Any]], replace: bool) -> None:
        content = {"commands": told, "replace_previous_commands": replace}
        assert self._says("publish", topic=COMMAND_LIST, msg=content) == []

    def calls(self, name: str, request: dict[str, Any]) -> Any:
        (response,) = self._says("call_service", service=name, args=request)
        assert response["result"] is True
        values = response["values"]
        for each in values.get("ios", []):
            assert set(each["stamp"]) == ({"sec", "nanosec"} if self._ros2 else {"secs", "nsecs"})
            each["stamp"] = list(each["stamp"].values())
        return values

    def results(self) -> list[tuple[int, int, str]]:
        self._hears()
        return self._results

    def _named(self, kind: str) -> str:
        return f"robot_movement_interface/{'msg/' if self._ros2 else ''}{kind}"

    def _says(self, operation: str, **fields: Any) -> list[dict[str, Any]]:
        self._session.receive(json.dumps({"op": operation, **fields}).encode())
        return self._hears()

    def _hears(self) -> list[dict[str, Any]]:
        replies = []
        while (frame := self._outbox.next(0.0).message) is not None:
            heard = json.loads(frame)
            if heard.get("topic") == RESULTS:
                told = heard["msg"]
                assert ("seq" in told["header"]) is not self._ros2
                self._results.append(
                    (told["command_id"], told["result_code"], told["additional_information"])
                )
            else:
                replies.append(heard)
        return replies


class Ros1Bytes:
    """By the bytes of TCPROS."""

    def __init__(self) -> None:
        self.robot = RosRobot()

    def sends(self, told: list[dict[str, Any]], replace: bool) -> None:
        definition = message(SUBSCRIBED[COMMAND_LIST])
        content = {"commands": told, "replace_previous_commands": replace}
        data = serialized(definition, _whole(definition, content))
        self.robot.node.receive(COMMAND_LIST, _read(definition, data))

    def calls(self, name: str, request: dict[str, Any]) -> Any:
        kind = service(self.robot.node.services[name])
        there = _read(kind.request, serialized(kind.request, _whole(kind.request, request)))
        answer = self.robot.node.call(name, there)
        back = _read(kind.response, serialized(kind.response, answer))
        for each in back.get("ios", []):
            each["stamp"] = list(each["stamp"].values())
        return back

    def results(self) -> list[tuple[int, int, str]]:
        definition = self.robot.node.definition("robot_movement_interface/Result")
        told = [_read(definition, serialized(definition, each)) for each in self.robot.heard[RESULTS]]
        return [(each["command_id"], each["result_code"], each["additional_information"]) for each in told]


def _whole(definition: Definition, content: dict[str, Any]) -> dict[str, Any]:
    """A message with the defaults of ROS where a field is not given."""
    whole: dict[str, Any] = msgspec.to_builtins(msgspec.convert(content, type_of(definition)))
    return whole


def _read(definition: Definition, data: bytes) -> dict[str, Any]:
    steps = deserialized(definition, data)
    while True:
        try:
            next(steps)
        except StopIteration as done:
            found: dict[str, Any] = done.value
            return found


def plays(front: Front, dialogue: list[Said]) -> tuple[list[Any], list[tuple[float, ...]]]:
    """What a client hears, and where the robot is after each tick."""
    robot, heard = front.robot, list[Any]()
    for said in dialogue:
        if said.list is not None:
            robot.notice_mode()
            front.sends(said.list, said.replace)
        if said.call is not None:
            heard.append(front.calls(*said.call))
        robot.step(said.ticks)
        heard.append(len(front.results()))
    heard.append(front.calls("/scale_speed", {"value": 1.0}))  # at 0 nothing would end
    ticks = round(LONGEST_S / robot.tick_s)
    while not robot.node._queue.empty:
        robot.step()
        ticks -= 1
        assert ticks, "a command has no result"
    return [heard, list(front.results())], robot.joints


@given(dialogues)
def test_results_and_motion_are_the_same_over_every_front(dialogue: list[Said]) -> None:
    """Tick by tick, to the last bit."""
    ros1, joints = plays(Rosbridge(ros2=False), dialogue)
    for other in (Rosbridge(ros2=True), Ros1Bytes()):
        assert plays(other, dialogue) == (ros1, joints)
