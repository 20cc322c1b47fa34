"""The environment of the node of ROS 2: its folder, and how it is made from wheels."""

import os
import subprocess
import sys
import venv
from importlib.resources import files
from pathlib import Path

from iiwa_sim.ros.relay import RosFault

WHEELS = [
    "ros-rclpy[fastrtps]",
    *(f"ros-{each}-msgs" for each in ("sensor", "trajectory", "geometry", "diagnostic", "rosgraph")),
    "ros-std-srvs",
]
"""Wheels on PyPI, for x86-64 Linux and CPython 3.10 to 3.14, of a third party: ros-python-wheels."""
INTERFACES = (
    "ros2/control_msgs",
    "ros2/tf2_msgs",
    "rmi/ros2/industrial_msgs",
    "rmi/ros2/robot_movement_interface",
)
"""Packages that the wheels lack, below `protocol`."""


def default_folder() -> Path:
    """Return the folder of the environment that `iiwa-sim ros2-env` makes."""
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(cache) / "iiwa-sim" / "ros2"


def found_python() -> Path:
    """Return that environment's interpreter, else one of a sourced distribution. Raises RosFault."""
    made = default_folder() / "bin" / "python"
    if made.exists():
        return made
    if "AMENT_PREFIX_PATH" in os.environ:
        return Path("/usr/bin/python3")
    raise RosFault(
        "--ros2 needs a Python that has rclpy: make one by iiwa-sim ros2-env, source a distribution of "
        "ROS 2, or name one by --ros2-python"
    )


def make(folder: Path) -> Path:
    """Make missing parts of the environment, and return its interpreter. Raises RosFault."""
    python = folder / "bin" / "python"
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "--quiet", "install", *WHEELS]
    packages = [str(files("iiwa_sim.protocol").joinpath(name)) for name in INTERFACES]
    compiled = [str(python), str(Path(__file__).with_name("ros2_interfaces.py")), *packages]
    try:
        if not python.exists():
            venv.create(folder, with_pip=True)
        subprocess.run(pip, stdout=sys.stderr, check=True)
        subprocess.run(compiled, stdout=sys.stderr, check=True)
    except (OSError, subprocess.CalledProcessError) as fault:
        why = (
            getattr(fault, "strerror", None) or "see above; it needs x86-64 Linux, PyPI, g++ and python3-dev"
        )
        raise RosFault(f"{folder} cannot be made an environment: {why}") from None
    return python
