"""What follows from a line of state in the terms of viewers: frames, joint states, the wrench."""

from typing import Any

import msgspec

from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.frames import Frame
from iiwa_sim.recordings.foxglove import stamp
from iiwa_sim.recordings.message import Message
from iiwa_sim.recordings.scene import TCP, Arm
from iiwa_sim.recordings.schemas import FRAMES, JOINTS, STATE, WRENCH

VIEW_RATE_HZ = 25
"""Rate of the views, in simulated time: a twentieth of what every tick would cost."""
_PERIOD_NS = 1_000_000_000 // VIEW_RATE_HZ


class _Seen(msgspec.Struct):
    """What of a line of state viewers are shown."""

    joint_position: list[float]
    joint_velocity: list[float]
    joint_torque: list[float]
    tool_frame: Frame
    goal_frame: Frame
    cartesian_force: tuple[float, float, float, float, float, float]
    gripper: GripperState | None = None
    parts: tuple[PartState, ...] = ()


class Views:
    """Makes them for every state that is due."""

    def __init__(self, arm: Arm, joints: tuple[str, ...]) -> None:
        """`joints` are the names of the arm's joints, base first."""
        self._arm = arm
        self._joints = joints
        self._due_ns = 0
        self._decoder = msgspec.json.Decoder(_Seen)
        self._encoder = msgspec.json.Encoder()

    def expand(self, message: Message) -> list[Message]:
        """The messages that follow from one: none, but from a state that is due."""
        if message.topic != STATE or message.log_ns < self._due_ns:
            return []
        late_ns = message.log_ns - self._due_ns
        self._due_ns = message.log_ns + _PERIOD_NS - (late_ns if late_ns < _PERIOD_NS else 0)
        seen = self._decoder.decode(message.data)
        time = stamp(message.log_ns)
        fx, fy, fz, tx, ty, tz = seen.cartesian_force
        made: dict[str, Any] = {
            FRAMES: self._arm.frames(
                message.log_ns,
                seen.joint_position,
                seen.tool_frame,
                seen.goal_frame,
                None if seen.gripper is None else seen.gripper.opening_mm,
                seen.parts,
            ),
            JOINTS: {
                "timestamp": time,
                "joints": [
                    {"name": name, "position": q, "velocity": v, "effort": t}
                    for name, q, v, t in zip(
                        self._joints,
                        seen.joint_position,
                        seen.joint_velocity,
                        seen.joint_torque,
                        strict=True,
                    )
                ],
            },
            WRENCH: {
                "timestamp": time,
                "frame_id": TCP,
                "force": {"x": fx, "y": fy, "z": fz},
                "torque": {"x": tx, "y": ty, "z": tz},
            },
        }
        encode = self._encoder.encode
        return [message._replace(topic=topic, data=encode(content)) for topic, content in made.items()]
