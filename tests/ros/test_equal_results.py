"""Every command gets one result, in order, and the same one in the words of ROS 1 and of ROS 2."""

from __future__ import annotations

from typing import Any, NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from tests.ros_robot import RosClient, RosRobot, command

HOME = [0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0]
HOME_POSE = [0.5, 0.0, 0.4, 0.0, 1.5, 0.0]  # m, rad
COMMAND_LIST, RESULTS = "/command_list", "/command_result"
LONGEST_S = 120.0
"""Simulated time in which every list has its results."""


def _near(places: list[float], by: float) -> st.SearchStrategy[list[float]]:
    away = st.floats(-by, by)
    return st.tuples(*(away for _ in places)).map(
        lambda found: [place + each for place, each in zip(places, found, strict=True)]
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


class Front:
    """A client of a robot, in the words of ROS 1 or of ROS 2."""

    def __init__(self, *, ros2: bool) -> None:
        self.robot = RosRobot()
        self._ros2 = ros2
        self._client = RosClient(self.robot)
        self._results: list[tuple[int, int, str]] = []
        self.sent: list[int] = []
        self._says("subscribe", topic=RESULTS, type=self._named("Result"))
        self._says("advertise", topic=COMMAND_LIST, type=self._named("CommandList"))

    def sends(self, told: list[dict[str, Any]], replace: bool) -> None:
        """Publish a list of commands."""
        content = {"commands": told, "replace_previous_commands": replace}
        assert self._says("publish", topic=COMMAND_LIST, msg=content) == []
        self.sent += [each["command_id"] for each in told]

    def calls(self, name: str, request: dict[str, Any]) -> Any:
        """The response, with times as lists."""
        (response,) = self._says("call_service", service=name, args=request)
        assert response["result"] is True
        values = response["values"]
        for each in values.get("ios", []):
            assert set(each["stamp"]) == ({"sec", "nanosec"} if self._ros2 else {"secs", "nsecs"})
            each["stamp"] = list(each["stamp"].values())
        return values

    def results(self) -> list[tuple[int, int, str]]:
        """All that have come by now."""
        self._hears(self._client.hears())
        return self._results

    def _named(self, kind: str) -> str:
        return f"robot_movement_interface/{'msg/' if self._ros2 else ''}{kind}"

    def _says(self, operation: str, **fields: Any) -> list[dict[str, Any]]:
        return self._hears(self._client.says(operation, **fields))

    def _hears(self, heard: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Keep results; return the rest."""
        for told in (each["msg"] for each in heard if each.get("topic") == RESULTS):
            assert ("seq" in told["header"]) is not self._ros2
            self._results.append((told["command_id"], told["result_code"], told["additional_information"]))
        return [each for each in heard if each.get("topic") != RESULTS]


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
    while not robot.appendix_a.is_idle:
        robot.step()
        ticks -= 1
        assert ticks, "a command has no result"
    assert [number for number, _, _ in front.results()] == front.sent, "each has one, in their order"
    return [heard, list(front.results())], robot.joints


@given(dialogues)
def test_results_and_motion_are_the_same_in_both_words(dialogue: list[Said]) -> None:
    """Tick by tick, to the last bit."""
    assert plays(Front(ros2=False), dialogue) == plays(Front(ros2=True), dialogue)
