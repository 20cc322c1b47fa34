"""The definitions that rosapi tells in the words of ROS 2, beside those that ROS 2 has itself."""

from __future__ import annotations

import json
import subprocess
from typing import Any

import pytest

from iiwa_sim.ros.arm.interfaces import PRIMITIVES, details, full_text, interface
from iiwa_sim.ros.arm.joint_level import ACTION_TYPE, PUBLISHED, SERVICES, SUBSCRIBED
from iiwa_sim.ros.rmi.message_text import Definition
from iiwa_sim.ros.ros2.environment import default_folder, python_in
from tests.needed import lacks
from tests.talking import DEADLINE_S

MESSAGES = sorted({*(kind for kind, _ in PUBLISHED.values()), *SUBSCRIBED.values()})
SAID = """
import importlib, json, sys

def told(cls):
    return {name: kind for name, kind in cls.get_fields_and_field_types().items()}

found = {}
for name in sys.argv[1:]:
    package, kind, own = name.split("/")
    try:
        made = getattr(importlib.import_module(f"{package}.{kind}"), own)
    except ImportError:
        continue
    halves = {"msg": [made], "srv": [getattr(made, "Request", 0), getattr(made, "Response", 0)]}.get(kind)
    found[name] = [told(each) for each in halves or [made.Goal, made.Result, made.Feedback]]
print(json.dumps(found))
"""
"""What the environment's Python knows of these interfaces."""


def every(names: list[str]) -> list[str]:
    """With all messages in them."""
    found, waiting = [], list(names)
    while waiting:
        name = waiting.pop(0)
        if name not in found:
            found.append(name)
            fields = (field.type for part in interface(name) for field in part.fields)
            waiting += [each.replace("/", "/msg/") for each in fields if each not in PRIMITIVES]
    return found


def in_python(part: Definition) -> dict[str, str]:
    """As what ROS 2 generates for Python tells the types."""
    told = {}
    for field in part.fields:
        kind = PRIMITIVES.get(field.type, (field.type, ""))[0]
        told[field.name] = {-1: kind, 0: f"sequence<{kind}>"}.get(field.length, f"{kind}[{field.length}]")
    return told


def test_they_are_those_that_ros_2_generates_from() -> None:
    python = python_in(default_folder())
    if not python.exists():
        lacks("an environment of iiwa-sim ros2-env")
    names = every(
        [*MESSAGES, *SERVICES.values(), ACTION_TYPE, "std_msgs/msg/Float32", "action_msgs/srv/CancelGoal"]
    )
    said = subprocess.run(
        [python, "-c", SAID, *names], capture_output=True, text=True, timeout=DEADLINE_S, check=True
    )
    known: dict[str, Any] = json.loads(said.stdout)
    assert "trajectory_msgs/msg/JointTrajectoryPoint" in known
    assert "std_srvs/srv/Trigger" in known
    for name, parts in known.items():
        ours = [in_python(part) for part in interface(name)]
        there = [{field: kind for field, kind in part.items() if field != EMPTY} for part in parts]
        assert ours == there, name


EMPTY = "structure_needs_at_least_one_member"


@pytest.mark.parametrize("name", MESSAGES)
def test_details_have_a_row_for_each_field(name: str) -> None:
    for each in details(interface(name)[0]):
        lengths = {len(each[f"field{row}"]) for row in ("names", "types", "arraylen")} | {
            len(each["examples"])
        }
        assert len(lengths) == 1
        assert len(each["constnames"]) == len(each["constvalues"])
    assert full_text(name).startswith(interface(name)[0].text)


@pytest.mark.parametrize(
    "name",
    ["", "std_msgs/Nothing", "../x/String", "std_msgs/srv/String"],
)
def test_a_name_that_is_none(name: str) -> None:
    with pytest.raises(KeyError):
        interface(name)
