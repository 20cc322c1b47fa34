"""What is in the joint level's messages: of one robot, now."""

from collections.abc import Callable
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.ros.arm.links import Links, tool_transform
from iiwa_sim.ros.arm.messages import time_of

Message = dict[str, Any]

STATES = "/robot_joint_states"
"""Where joint_state_topic_hardware_interface, with which ros2_control drives a robot, expects its states."""
TOOL = "tool"
"""The frame of the TCP."""
_OK, _ERROR = 0, 2  # of DiagnosticStatus


class Contents:
    """The messages of one robot's topics."""

    def __init__(self, controller: Controller, links: Links, now_ns: Callable[[], int]) -> None:
        """`now_ns` returns the time that goes into headers (ns)."""
        self._controller = controller
        self._links = links
        self._now_ns = now_ns

    def of(self, topic: str) -> Message:
        """The message for a topic."""
        controller, stamp = self._controller, time_of(self._now_ns())
        if topic == "/clock":
            return {"clock": time_of(round(1e9 * controller.tick * controller.tick_s))}
        if topic == "/robot_description":
            return {"data": controller.description.urdf}
        if topic == "/tf_static":
            return {"transforms": self._stamped(self._links.fixed())}
        if topic == "/tf":
            return {"transforms": self._stamped(self._moving())}
        if topic == STATES:
            return {
                "header": {"stamp": stamp, "frame_id": ""},
                "name": list(controller.description.joints),
                "position": list(controller.joints),
                "velocity": list(controller.joint_velocity()),
                "effort": [],
            }
        if topic == "/wrench":
            wrench = controller.cartesian_force()
            parts = {
                "force": dict(zip("xyz", wrench[:3], strict=True)),
                "torque": dict(zip("xyz", wrench[3:], strict=True)),
            }
            return {"header": {"stamp": stamp, "frame_id": TOOL}, "wrench": parts}
        return {"header": {"stamp": stamp, "frame_id": ""}, "status": [self._diagnosis()]}

    def _diagnosis(self) -> Message:
        status, last = self._controller.status(), self._controller.last_error
        reason = "" if last is None else last.reason
        return {
            "level": _ERROR if status.in_error else _OK,
            "name": "iiwa_sim: robot",
            "message": reason if status.in_error else "ok",
            "hardware_id": "iiwa_sim",
            "values": [{"key": "error_code", "value": str(status.error_code if status.in_error else 0)}],
        }

    def _moving(self) -> list[Message]:
        controller = self._controller
        tool = tool_transform(controller.description.flange, TOOL, controller.tool_in_flange)
        return [*self._links.moving(controller.joints), tool]

    def _stamped(self, transforms: list[Message]) -> list[Message]:
        stamp = time_of(self._now_ns())
        return [{**each, "header": {"stamp": stamp, **each["header"]}} for each in transforms]
