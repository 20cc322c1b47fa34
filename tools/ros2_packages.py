"""Write protocol/rmi/ros2, Appendix A's packages for ROS 2, of ROS 1's: `python -m tools.ros2_packages`.

Names, fields, constants and comments are the same. What ROS 2 has another name for gets that: `Header` is
std_msgs/Header there, `time` builtin_interfaces/Time.
"""

import re
from pathlib import Path

RMI = Path(__file__).parent.parent / "protocol" / "rmi"
ROS2 = RMI / "ros2"
PACKAGES = {
    "industrial_msgs": "What the status of a robot is told with",
    "robot_movement_interface": "Commands, results and services of drag&amp;bot's robot drivers",
}
"""Packages that no distribution of ROS 2 has, with their descriptions."""
VERSION = "0.1.0"
_IN_ROS2 = {"Header": "std_msgs/Header", "time": "builtin_interfaces/Time"}
_TYPE = re.compile(rf"^({'|'.join(_IN_ROS2)})(?=(\[\])? )", re.MULTILINE)


def files() -> dict[str, str]:
    """The text of each file, by its path in protocol/rmi/ros2."""
    found = {"rospack_nosubdirs": ""}  # for rospack of ROS 1, which has packages of the same names beside
    for package, description in PACKAGES.items():
        interfaces = {
            f"{kind}/{path.name}": _TYPE.sub(lambda found: _IN_ROS2[found[1]], path.read_text())
            for kind in ("msg", "srv")
            for path in sorted((RMI / package / kind).glob(f"*.{kind}"))
        }
        others = [name for name in ("builtin_interfaces", "std_msgs") if _names(name, interfaces)]
        found |= {f"{package}/{name}": text for name, text in interfaces.items()}
        found[f"{package}/package.xml"] = _manifest(package, description, others)
        found[f"{package}/CMakeLists.txt"] = _build(package, list(interfaces), others)
    return found


def _names(package: str, interfaces: dict[str, str]) -> bool:
    return any(f"{package}/" in text for text in interfaces.values())


def _manifest(package: str, description: str, others: list[str]) -> str:
    depends = "".join(f"  <depend>{name}</depend>\n" for name in others)
    return f"""\
<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>{VERSION}</version>
  <description>{description}</description>
  <maintainer email="nobody@example.com">iiwa-sim contributors</maintainer>
  <license>MIT</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""


def _build(package: str, interfaces: list[str], others: list[str]) -> str:
    found = "".join(f"find_package({name} REQUIRED)\n" for name in others)
    named = "".join(f'  "{name}"\n' for name in interfaces)
    return f"""\
cmake_minimum_required(VERSION 3.12)
project({package})

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{found}
rosidl_generate_interfaces(${{PROJECT_NAME}}
{named}  DEPENDENCIES {" ".join(others)}
)

ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


if __name__ == "__main__":
    for name, text in files().items():
        path = ROS2 / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
