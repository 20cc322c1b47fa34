"""Messages of ROS 2 that come to the robot, as types that check them, and those of ROS 1 in ROS 2's form.

Missing fields get the defaults of ROS, unknown ones are refused. The definitions are those of
common_interfaces and control_msgs: https://github.com/ros2/common_interfaces,
https://github.com/ros-controls/control_msgs.
"""

from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta, Struct, field

from iiwa_sim.ros.rmi.definitions import message
from iiwa_sim.ros.rmi.message_text import Definition

NS_PER_S = 1_000_000_000

Kind = TypeVar("Kind")


class Time(Struct, forbid_unknown_fields=True):
    """builtin_interfaces/Time and Duration."""

    sec: Annotated[int, Meta(ge=-(2**31), le=2**31 - 1)] = 0
    nanosec: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0

    @property
    def ns(self) -> int:
        """All of it in nanoseconds."""
        return self.sec * NS_PER_S + self.nanosec

    @property
    def seconds(self) -> float:
        """All of it in seconds."""
        return self.sec + 1e-9 * self.nanosec


class Header(Struct, forbid_unknown_fields=True):
    """std_msgs/Header."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


class Point(Struct, forbid_unknown_fields=True):
    """trajectory_msgs/JointTrajectoryPoint."""

    positions: list[float] = field(default_factory=list)
    velocities: list[float] = field(default_factory=list)
    accelerations: list[float] = field(default_factory=list)
    effort: list[float] = field(default_factory=list)
    time_from_start: Time = field(default_factory=Time)


class JointTrajectory(Struct, forbid_unknown_fields=True):
    """trajectory_msgs/JointTrajectory."""

    header: Header = field(default_factory=Header)
    joint_names: list[str] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)


class MultiDofTrajectory(Struct, forbid_unknown_fields=True):
    """trajectory_msgs/MultiDOFJointTrajectory: only an empty one is taken."""

    header: Header = field(default_factory=Header)
    joint_names: list[str] = field(default_factory=list)
    points: list[Any] = field(default_factory=list)


class JointTolerance(Struct, forbid_unknown_fields=True):
    """control_msgs/JointTolerance."""

    name: str = ""
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


class FollowJointTrajectory(Struct, forbid_unknown_fields=True):
    """The goal of control_msgs/FollowJointTrajectory."""

    trajectory: JointTrajectory = field(default_factory=JointTrajectory)
    multi_dof_trajectory: MultiDofTrajectory = field(default_factory=MultiDofTrajectory)
    path_tolerance: list[JointTolerance] = field(default_factory=list)
    component_path_tolerance: list[Any] = field(default_factory=list)
    goal_tolerance: list[JointTolerance] = field(default_factory=list)
    component_goal_tolerance: list[Any] = field(default_factory=list)
    goal_time_tolerance: Time = field(default_factory=Time)


class JointState(Struct, forbid_unknown_fields=True):
    """sensor_msgs/JointState."""

    header: Header = field(default_factory=Header)
    name: list[str] = field(default_factory=list)
    position: list[float] = field(default_factory=list)
    velocity: list[float] = field(default_factory=list)
    effort: list[float] = field(default_factory=list)


class Float64(Struct, forbid_unknown_fields=True):
    """std_msgs/Float64."""

    data: float = 0.0


class Vector3(Struct, forbid_unknown_fields=True):
    """geometry_msgs/Vector3."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Twist(Struct, forbid_unknown_fields=True):
    """geometry_msgs/Twist."""

    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


class TwistStamped(Struct, forbid_unknown_fields=True):
    """geometry_msgs/TwistStamped."""

    header: Header = field(default_factory=Header)
    twist: Twist = field(default_factory=Twist)


class SetBool(Struct, forbid_unknown_fields=True):
    """The request of std_srvs/SetBool."""

    data: bool = False


class Trigger(Struct, forbid_unknown_fields=True):
    """The request of std_srvs/Trigger."""


def time_of(ns: int) -> dict[str, int]:
    """A time or a duration as ROS 2 has it."""
    sec, nanosec = divmod(ns, NS_PER_S)
    return {"sec": sec, "nanosec": nanosec}


def in_ros2(definition: Definition, content: dict[str, Any]) -> dict[str, Any]:
    """A message of ROS 1 as ROS 2 has it: headers without numbers, times with other names."""
    told: dict[str, Any] = {}
    for each in definition.fields:
        value = content[each.name]
        if each.type == "time":
            told[each.name] = {"sec": value["secs"], "nanosec": value["nsecs"]}
        elif "/" in each.type:
            part = message(each.type)
            told[each.name] = [in_ros2(part, one) for one in value] if each.is_list else in_ros2(part, value)
        elif not (definition.name == "std_msgs/Header" and each.name == "seq"):
            told[each.name] = value
    return told


def in_ros1(definition: Definition, content: Any) -> Any:
    """A message of ROS 2 as ROS 1 has it; what does not fit is left as it is, for the type to refuse."""
    if not isinstance(content, dict):
        return content
    types = {each.name: each for each in definition.fields}
    told: dict[str, Any] = {}
    for name, value in content.items():
        each = types.get(name)
        if each is not None and each.type == "time" and isinstance(value, dict):
            names = {"sec": "secs", "nanosec": "nsecs"}
            value = {names.get(key, key): part for key, part in value.items()}
        elif each is not None and "/" in each.type:
            part = message(each.type)
            if each.is_list and isinstance(value, list):
                value = [in_ros1(part, one) for one in value]
            elif not each.is_list:
                value = in_ros1(part, value)
        told[name] = value
    return told


def ros1_name(name: str) -> str:
    """package/Type of package/msg/Type; other names as they are."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[2]}" if len(parts) == 3 and parts[1] in ("msg", "srv", "action") else name


class BadGoal(Exception):
    """A goal or message does not fit its type. One line, with the place."""


def converted(content: Any, kind: type[Kind]) -> Kind:
    """A message of that type. Raises `BadGoal`."""
    try:
        return msgspec.convert(content, kind)
    except (msgspec.ValidationError, RecursionError) as fault:
        raise BadGoal(str(fault)) from None
