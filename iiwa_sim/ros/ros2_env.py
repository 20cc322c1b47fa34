"""The environment of the node of ROS 2: where it is looked for, and how one is made from wheels."""

import os
import subprocess
import sys
import venv
from importlib.resources import files
from pathlib import Path

from iiwa_sim.ros.relay import RosFault
from iiwa_sim.wording import shortened

PACKAGES = (
    "ros-rclpy[fastrtps]",
    "ros-sensor-msgs",
    "ros-std-srvs",
    "ros-trajectory-msgs",
    "ros-geometry-msgs",
    "ros-diagnostic-msgs",
    "ros-rosgraph-msgs",
)
"""Wheels on PyPI, for x86-64 Linux and CPython 3.10 to 3.14, of a third party: ros-python-wheels."""

INTERFACES = (
    "ros2/control_msgs",
    "ros2/tf2_msgs",
    "rmi/ros2/industrial_msgs",
    "rmi/ros2/robot_movement_interface",
)
"""Packages that the wheels lack, below `protocol`: made there where a C++ compiler is."""
STAMP = "iiwa-sim-interfaces"
"""A file in the environment, once its interfaces are made."""


def default_folder() -> Path:
    """Return the folder of the environment that `iiwa-sim ros2-env` makes."""
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(cache) / "iiwa-sim" / "ros2"


def python_in(folder: Path) -> Path:
    """The interpreter of an environment."""
    return folder / "bin" / "python"


def found_python() -> Path:
    """Return that environment's interpreter, else one of a sourced distribution. Raises RosFault."""
    made = python_in(default_folder())
    if made.exists():
        return made
    if "AMENT_PREFIX_PATH" in os.environ:
        return Path("/usr/bin/python3")
    raise RosFault(
        "--ros2 needs a Python that has rclpy: make one by iiwa-sim ros2-env, source a distribution of "
        "ROS 2, or name one by --ros2-python"
    )


def make(folder: Path) -> str:
    """Make the environment, unless it is there; what pip says goes to standard error. Raises RosFault.

    Returns why the interfaces that the wheels lack were not made; "" if they were.
    """
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        raise RosFault("the wheels of rclpy are for x86-64 Linux alone: use a distribution, or rosbridge")
    python, stamp = python_in(folder), folder / STAMP
    if python.exists() and stamp.exists():
        return ""
    try:
        venv.create(folder, with_pip=True)
    except (OSError, subprocess.CalledProcessError) as fault:
        raise RosFault(f"{folder} cannot be made an environment: {fault}") from None
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "--quiet"]
    if subprocess.run([*pip, "install", *PACKAGES], stdout=sys.stderr, check=False).returncode:
        raise RosFault(f"pip could not install {PACKAGES[0]} into {folder}: what it says is above")
    packages = [str(files("iiwa_sim.protocol").joinpath(name)) for name in INTERFACES]
    script = Path(__file__).with_name("ros2_interfaces.py")
    made = subprocess.run([str(python), script, *packages], capture_output=True, text=True, check=False)
    if made.returncode:
        return shortened(" ".join(made.stderr.split()), 500)
    stamp.touch()
    return ""
