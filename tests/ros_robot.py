"""A robot in simulated time on ROS, and a client of rosbridge that drives it message by message."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from iiwa_sim.ros.appendix_a import AppendixA
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.joint_interface import JointInterface
from iiwa_sim.ros.outbox import Outbox
from iiwa_sim.ros.rosbridge_session import RosbridgeSession
from tests.journal import Journal
from tests.stepped import SteppedRobot

NOW_NS = 1_700_000_000_250_000_000


class RosRobot(SteppedRobot):
    """Robot on ROS that keeps the messages of subscribed topics in `messages`, in the form of ROS 2."""

    def __init__(self, *, apply_reference: bool = True, **options: Any) -> None:
        super().__init__(**options)
        self.log = Journal(fails=True)
        self.graph = Graph(self.controller, lambda: NOW_NS)
        self.appendix_a = AppendixA(self.graph, self.controller, self.log, apply_reference=apply_reference)
        self.joint_interface = JointInterface(self.graph, self.controller, self.appendix_a.joint_states)
        self.messages: dict[str, list[dict[str, Any]]] = {}
        self.subscribes("/command_result")

    def subscribes(self, topic: str) -> list[dict[str, Any]]:
        messages = self.messages.setdefault(topic, [])
        self.graph.listen(topic, messages.append)
        return messages

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            super().step()
            self.appendix_a.step()
            self.graph.step()
            self.joint_interface.step()

    def gets(self, *commands: dict[str, Any], replace: bool = False) -> None:
        self.notice_mode()
        self.graph.receive(
            "/command_list", {"commands": list(commands), "replace_previous_commands": replace}
        )
        self._stop_ticks = self._longest_stop if replace else self._stop_ticks

    def calls(self, service: str, **request: Any) -> Any:
        """Call a service; return the response."""
        return self.graph.call(service, request)

    @property
    def results(self) -> list[tuple[int, int]]:
        """Ids and codes, in the order in which they came."""
        return [(r["command_id"], r["result_code"]) for r in self.messages["/command_result"]]

    @property
    def words(self) -> list[str]:
        return [result["additional_information"] for result in self.messages["/command_result"]]

    def runs_until_results(self, count: int, limit_s: float = 60.0) -> None:
        ticks = 0
        while len(self.results) < count:
            self.step()
            ticks += 1
            assert ticks * self.tick_s < limit_s, self.results


class RosClient:
    """A client of rosbridge."""

    def __init__(self, robot: RosRobot) -> None:
        self.robot = robot
        self.outbox = Outbox()
        self.session = RosbridgeSession(robot.graph, robot.joint_interface, self.outbox, robot.log, "test")

    def performs(self, operation: str, **fields: Any) -> list[dict[str, Any]]:
        """Return the messages that answer an operation."""
        return self.sends(json.dumps({"op": operation, **fields}).encode())

    def sends(self, text: bytes) -> list[dict[str, Any]]:
        self.session.receive(text)
        return self.receives()

    def receives(self) -> list[dict[str, Any]]:
        """Return all messages that may be sent now."""
        messages = []
        while (frame := self.outbox.next(self.robot.controller.tick * self.robot.tick_s)[0]) is not None:
            messages.append(json.loads(frame))
        return messages

    def error_of(self, operation: str, **fields: Any) -> str:
        """Return the message of the error that is the only answer."""
        (status,) = self.performs(operation, **fields)
        assert (status["op"], status["level"]) == ("status", "error")
        assert status.get("id") == fields.get("id")
        return str(status["msg"])

    def calls(self, service: str, args: Any = None, **fields: Any) -> dict[str, Any]:
        (response,) = self.performs(
            "call_service", service=service, **({} if args is None else {"args": args}), **fields
        )
        assert (response["op"], response["service"]) == ("service_response", service)
        return response


def ptp(identifier: int, joints: Sequence[float], **fields: Any) -> dict[str, Any]:
    """Return a PTP command to joint positions at half speed."""
    return command(identifier, "PTP", "JOINTS", joints, **fields)


def command(
    identifier: int, kind: str, pose_type: str, pose: Sequence[float], **fields: Any
) -> dict[str, Any]:
    target = {"command_id": identifier, "command_type": kind, "pose_type": pose_type, "pose": list(pose)}
    return {**target, "velocity_type": "%", "velocity": [0.5], **fields}
