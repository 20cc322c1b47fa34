"""Messages of ROS 2: their times, and messages of ROS 1 in their form."""

from typing import Any

from iiwa_sim.ros.rmi.definitions import message
from iiwa_sim.ros.rmi.message_text import Definition

NS_PER_S = 1_000_000_000


def time_of(ns: int) -> dict[str, int]:
    """A time or a duration as ROS 2 has it."""
    sec, nanosec = divmod(ns, NS_PER_S)
    return {"sec": sec, "nanosec": nanosec}


def ns_of(time: Any) -> int:
    """A builtin_interfaces/Time or Duration in nanoseconds."""
    ns: int = time.sec * NS_PER_S + time.nanosec
    return ns


def seconds_of(time: Any) -> float:
    """A builtin_interfaces/Time or Duration in seconds."""
    seconds: float = time.sec + 1e-9 * time.nanosec
    return seconds


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
