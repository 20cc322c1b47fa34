"""The environment of the node of ROS 2: where it is looked for, and how one is made from wheels."""

import os
import subprocess
import sys
import venv
from pathlib import Path

from iiwa_sim.ros.fault import RosFault

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


def default_folder() -> Path:
    """Where `iiwa-sim ros2-env` makes the environment, and `--ros2` looks for it."""
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(cache) / "iiwa-sim" / "ros2"


def python_in(folder: Path) -> Path:
    """The interpreter of an environment."""
    return folder / "bin" / "python"


def found_python() -> Path:
    """The interpreter for the node, where none is named: that environment's, else one of a sourced
    distribution.

    Raises RosFault where there is none.
    """
    made = python_in(default_folder())
    if made.exists():
        return made
    if "AMENT_PREFIX_PATH" in os.environ:
        return Path("/usr/bin/python3")
    raise RosFault(
        "--ros2 needs a Python that has rclpy: make one by iiwa-sim ros2-env, source a distribution of "
        "ROS 2, or name one by --ros2-python"
    )


def make(folder: Path) -> None:
    """Make the environment, or bring it up to date; what pip says goes to standard error. Raises RosFault."""
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        raise RosFault("the wheels of rclpy are for x86-64 Linux alone: use a distribution, or rosbridge")
    try:
        venv.create(folder, with_pip=True)
    except (OSError, subprocess.CalledProcessError) as fault:
        raise RosFault(f"{folder} cannot be made an environment: {fault}") from None
    pip = [
        str(python_in(folder)),
        "-m",
        "pip",
        "--disable-pip-version-check",
        "install",
        "--quiet",
        *PACKAGES,
    ]
    if subprocess.run(pip, stdout=sys.stderr, check=False).returncode:
        raise RosFault(f"pip could not install {PACKAGES[0]} into {folder}: what it says is above")
