"""A robot in simulated time as a ROS node, and the messages that go to it and come from it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from iiwa_sim.ros.arm.joint_level import JointLevel
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.rmi.node import Node
from tests.journal import Journal
from tests.stepped import SteppedRobot

NOW_NS = 1_700_000_000_250_000_000


class RosRobot(SteppedRobot):
    """Everything that its node publishes is kept in `heard`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.log = Journal(fails=True)
        self.node = Node(self.controller, lambda: NOW_NS, round(1.0 / self.tick_s), self.log)
        self.heard: dict[str, list[dict[str, Any]]] = {}
        self.hears("/command_result")

    @cached_property
    def level(self) -> JointLevel:
        return JointLevel(self.controller, lambda: NOW_NS, round(1.0 / self.tick_s), self.log)

    @cached_property
    def graph(self) -> Graph:
        return Graph(self.node, self.level)

    def hears(self, topic: str) -> list[dict[str, Any]]:
        messages = self.heard.setdefault(topic, [])
        self.node.listen(topic, messages.append)
        return messages

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            super().step()
            self.node.step()

    def gets(self, *commands: dict[str, Any], replace: bool = False) -> None:
        self.notice_mode()
        self.node.receive("/command_list", {"commands": commands, "replace_previous_commands": replace})
        self._stop_ticks = self._longest_stop if replace else self._stop_ticks

    def calls(self, service: str, **request: Any) -> Any:
        """The response."""
        return self.node.call(service, request)

    @property
    def results(self) -> list[tuple[int, int]]:
        """Ids and codes, in the order in which they came."""
        return [(r["command_id"], r["result_code"]) for r in self.heard["/command_result"]]

    @property
    def words(self) -> list[str]:
        return [result["additional_information"] for result in self.heard["/command_result"]]

    def runs_until_results(self, count: int, limit_s: float = 60.0) -> None:
        ticks = 0
        while len(self.results) < count:
            self.step()
            ticks += 1
            assert ticks * self.tick_s < limit_s, self.results


def ptp(identifier: int, joints: Sequence[float], **fields: Any) -> dict[str, Any]:
    """A PTP command to joint positions at half speed."""
    return command(identifier, "PTP", "JOINTS", joints, **fields)


def command(
    identifier: int, kind: str, pose_type: str, pose: Sequence[float], **fields: Any
) -> dict[str, Any]:
    whither = {"command_id": identifier, "command_type": kind, "pose_type": pose_type, "pose": list(pose)}
    return {**whither, "velocity_type": "%", "velocity": [0.5], **fields}
