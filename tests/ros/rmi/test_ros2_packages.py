"""Appendix A's packages for ROS 2: as its own parsers read them, they say the same as those for ROS 1."""

from __future__ import annotations

import json
from typing import Any

import pytest

from iiwa_sim.ros.rmi.definitions import message, service
from iiwa_sim.ros.rmi.message_text import Definition
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED
from iiwa_sim.ros.ros2.environment import default_folder, python_in
from tests.needed import lacks
from tests.processes import succeeds
from tools.ros2_packages import PACKAGES, RMI, ROS2, files

IN_ROS2 = {"time": "builtin_interfaces/Time"}
READ = """
import json, pathlib, sys, tempfile
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.parser import parse_message_string, parse_service_string
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_parser.definition import IdlLocator
from rosidl_parser.parser import parse_idl_file

def told(spec):
    return {
        "fields": [[str(each.type), each.name] for each in spec.fields],
        "constants": [[each.type, each.name, each.value] for each in spec.constants],
    }

found = {}
for package in sys.argv[2:]:
    folder = pathlib.Path(sys.argv[1]) / package
    for path in sorted(folder.glob("*/*")):
        kind, name, text = path.parent.name, f"{package}/{path.stem}", path.read_text()
        if kind == "msg":
            found[name] = told(parse_message_string(package, path.stem, text))
        else:
            spec = parse_service_string(package, path.stem, text)
            found[name + "Request"], found[name + "Response"] = told(spec.request), told(spec.response)
        with tempfile.TemporaryDirectory() as scratch:
            convert = convert_msg_to_idl if kind == "msg" else convert_srv_to_idl
            idl = convert(folder, package, path.relative_to(folder), pathlib.Path(scratch))
            assert parse_idl_file(IdlLocator(scratch, idl.name)).content.elements
print(json.dumps(found))
"""


def test_the_files_are_those_that_the_tool_writes() -> None:
    there = {str(path.relative_to(ROS2)): path.read_text() for path in ROS2.rglob("*") if path.is_file()}
    assert there == files()


def test_every_type_of_a_package_without_a_distribution_is_there() -> None:
    kinds = {kind for kind, _ in PUBLISHED.values()} | set(SUBSCRIBED.values())
    missing = {kind for kind in kinds if kind.split("/")[0] in PACKAGES} - {
        name.replace("/msg/", "/").removesuffix(".msg") for name in files()
    }
    assert not missing


@pytest.mark.requirement("FRA002")
def test_ros_2_reads_in_them_what_ros_1_reads_in_its_own() -> None:
    python = python_in(default_folder())
    if not python.exists():
        lacks("an environment of iiwa-sim ros2-env")
    said = succeeds([python, "-c", READ, ROS2, *PACKAGES])
    told = json.loads(said.splitlines()[-1])  # the converter says what it does
    ours = [message(name) for name in _names("msg")]
    ours += [half for name in _names("srv") for half in (service(name).request, service(name).response)]
    assert told == {each.name: _in_ros2(each) for each in ours}


def _names(kind: str) -> list[str]:
    """Of all definitions for ROS 1 of that kind, msg or srv."""
    paths = (path for package in PACKAGES for path in (RMI / package).glob(f"{kind}/*.{kind}"))
    return [f"{path.parts[-3]}/{path.stem}" for path in paths]


def _in_ros2(definition: Definition) -> dict[str, Any]:
    fields = [
        [IN_ROS2.get(each.type, each.type) + ("[]" if each.is_list else ""), each.name]
        for each in definition.fields
    ]
    constants = [[kind, name, int(value)] for kind, name, value in definition.constants]
    return {"fields": fields, "constants": constants}
