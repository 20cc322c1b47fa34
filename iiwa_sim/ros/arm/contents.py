"""What is in the joint level's messages: of one robot, now."""

from collections.abc import Callable
from typing import Any

from iiwa_sim.ros.arm.arm import Arm
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

    def __init__(self, arm: Arm, links: Links, now_ns: Callable[[], int]) -> None:
        """`now_ns` returns the time that goes into headers (ns)."""
        self._arm = arm
        self._links = links
        self._now_ns = now_ns

    def of(self, topic: str) -> Message | None:
        """The message for a topic; None where the robot does not tell what is in it."""
        arm = self._arm
        if topic == "/clock":
            return None if arm.time_s is None else {"clock": time_of(round(1e9 * arm.time_s))}
        if topic == "/robot_description":
            return {"data": arm.description.urdf}
        if topic == "/tf_static":
            return {"transforms": self._stamped(self._links.fixed())}
        joints, stamp = arm.joints, time_of(self._now_ns())
        if topic == "/tf":
            return None if joints is None else {"transforms": self._stamped(self._moving(joints))}
        if topic == STATES:
            return None if joints is None else self._joint_state(joints, stamp)
        if topic == "/wrench":
            if arm.wrench is None:
                return None
            force, torque = arm.wrench[:3], arm.wrench[3:]
            parts = {
                "force": dict(zip("xyz", force, strict=True)),
                "torque": dict(zip("xyz", torque, strict=True)),
            }
            return {"header": {"stamp": stamp, "frame_id": TOOL}, "wrench": parts}
        fault = arm.fault
        status = {
            "level": _OK if fault is None else _ERROR,
            "name": "iiwa_sim: robot",
            "message": "ok" if fault is None else fault.reason,
            "hardware_id": "iiwa_sim",
            "values": [{"key": "error_code", "value": str(0 if fault is None else fault.code)}],
        }
        return {"header": {"stamp": stamp, "frame_id": ""}, "status": [status]}

    def _moving(self, joints: tuple[float, ...]) -> list[Message]:
        tool = self._arm.tool_in_flange
        told = [] if tool is None else [tool_transform(self._arm.description.flange, TOOL, tool)]
        return [*self._links.moving(joints), *told]

    def _joint_state(self, joints: tuple[float, ...], stamp: Message) -> Message:
        return {
            "header": {"stamp": stamp, "frame_id": ""},
            "name": list(self._arm.description.joints),
            "position": list(joints),
            "velocity": list(self._arm.velocities or ()),
            "effort": [],
        }

    def _stamped(self, transforms: list[Message]) -> list[Message]:
        stamp = time_of(self._now_ns())
        return [{**each, "header": {"stamp": stamp, **each["header"]}} for each in transforms]
