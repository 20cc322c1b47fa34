"""The description of a robot: its folder, read and checked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from operator import mul
from pathlib import Path

from iiwa_sim.frames import Transform
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.found_poses import FoundPoses, read_found_poses
from iiwa_sim.robot.settings import read_settings
from iiwa_sim.settings import Reader

__all__ = ["DEFAULT_ROBOT", "RobotDescription", "RobotFault", "built_in_robots", "load_robot"]

DEFAULT_ROBOT = "lbr_iiwa_7_r800"
SETTINGS_FILE = "robot.toml"
URDF_FILE = "robot.urdf"


@dataclass(frozen=True)
class RobotDescription:
    """A robot as its robot.toml describes it. One value per joint, base first; rad, m, s, Nm."""

    name: str
    kinematics: str
    """Kind of the inverse kinematics, see `iiwa_sim.robot.inverse`."""
    joints: tuple[str, ...]
    """Names of the joints in the URDF."""
    flange: str
    """Link of the URDF that is the flange."""
    tool_in_flange: Transform
    """Pose of the TCP in the flange until a client sets another tool."""
    home: tuple[float, ...]
    position_min: tuple[float, ...]
    position_max: tuple[float, ...]
    velocity: tuple[float, ...]
    torque: tuple[float, ...]
    acceleration: tuple[float, ...]
    """Limit of planned motion."""
    jerk: tuple[float, ...]
    """Limit of planned motion."""
    direct_acceleration: tuple[float, ...]
    """Limit in direct mode."""
    direct_jerk: tuple[float, ...]
    """Limit in direct mode."""
    stop_rate_per_s: float
    """Largest slope of the rate of planned time, which falls from 1 to 0 in a stop."""
    stop_rate_change_per_s2: float
    """Largest change of that slope."""
    settings_path: str
    """Path of the robot.toml, for messages."""
    urdf_path: str
    """Path of the URDF, for messages."""
    urdf: str
    """Text of the URDF."""
    found_poses: FoundPoses | None = None
    """What was found in a URDF before, if it is kept in the robot's folder."""

    @property
    def stop_acceleration(self) -> tuple[float, ...]:
        """Acceleration limit (rad/s^2) in a stop.

        On the path q(t) at the rate r of its time, q'' = r^2 a + r' v, with r <= 1.
        """
        return self._stop_acceleration(self.acceleration)

    @property
    def stop_jerk(self) -> tuple[float, ...]:
        """Jerk limit (rad/s^3) in a stop: q''' = r^3 j + 3 r r' a + r'' v, with r <= 1."""
        return self._stop_jerk(self.acceleration, self.jerk)

    @property
    def direct_stop_acceleration(self) -> tuple[float, ...]:
        """`stop_acceleration` in direct mode."""
        return self._stop_acceleration(self.direct_acceleration)

    @property
    def direct_stop_jerk(self) -> tuple[float, ...]:
        """`stop_jerk` in direct mode."""
        return self._stop_jerk(self.direct_acceleration, self.direct_jerk)

    def _stop_acceleration(self, acceleration: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(a + self.stop_rate_per_s * v for a, v in zip(acceleration, self.velocity, strict=True))

    def _stop_jerk(self, acceleration: tuple[float, ...], jerk: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(
            j + 3.0 * self.stop_rate_per_s * a + self.stop_rate_change_per_s2 * v
            for j, a, v in zip(jerk, acceleration, self.velocity, strict=True)
        )


def load_robot(name_or_folder: str | Path = DEFAULT_ROBOT) -> RobotDescription:
    """The built-in robot of that name, or else the robot in that folder.

    A built-in robot is read once in a process. Raises `RobotFault` if the folder is missing or does not
    describe a robot. The URDF is checked when the `Model` is built, and whether its geometry suits the
    kinematics when the inverse is.
    """
    name = str(name_or_folder)
    return _built_in(name) if name in _names() else _read(_folder(name_or_folder), name_or_folder)


@cache
def _built_in(name: str) -> RobotDescription:
    return _read(files("iiwa_sim.robots") / name, name)


def _read(folder: Traversable, name_or_folder: str | Path) -> RobotDescription:
    settings_path = str(folder / SETTINGS_FILE)
    urdf_path = str(folder / URDF_FILE)
    settings = read_settings(settings_path, _text(folder, SETTINGS_FILE, name_or_folder))
    limits, direct = settings.limits, settings.direct
    velocity = limits.velocity()
    acceleration = tuple(map(mul, limits.acceleration_ratios(), velocity))
    direct_acceleration = tuple(map(mul, direct.acceleration_ratios(len(velocity)), velocity))
    return RobotDescription(
        name=settings.name,
        kinematics=settings.kinematics,
        joints=tuple(settings.joints),
        flange=settings.flange,
        tool_in_flange=settings.tool_in_flange.to_transform(),
        home=settings.home(),
        position_min=limits.position_min(),
        position_max=limits.position_max(),
        velocity=velocity,
        torque=tuple(limits.torque_nm),
        acceleration=acceleration,
        jerk=tuple(limits.jerk_per_acceleration_per_s * a for a in acceleration),
        direct_acceleration=direct_acceleration,
        direct_jerk=tuple(direct.jerk_per_acceleration_per_s * a for a in direct_acceleration),
        stop_rate_per_s=settings.stop.rate_per_s,
        stop_rate_change_per_s2=settings.stop.rate_change_per_s2,
        settings_path=settings_path,
        urdf_path=urdf_path,
        urdf=_text(folder, URDF_FILE, name_or_folder),
        found_poses=read_found_poses(folder),
    )


def built_in_robots() -> list[str]:
    """Names of the built-in robots."""
    return list(_names())


@cache
def _names() -> tuple[str, ...]:
    folders = files("iiwa_sim.robots").iterdir()
    return tuple(sorted(folder.name for folder in folders if (folder / SETTINGS_FILE).is_file()))


def _folder(name_or_folder: str | Path) -> Traversable:
    folder = Path(name_or_folder)
    why = ""
    try:
        if str(name_or_folder) and folder.is_dir():
            return folder
    except OSError as fault:  # a name that is too long, or a parent folder without permission
        why = f" ({fault.strerror})"
    given = str(name_or_folder) or "''"
    raise RobotFault("robot", "folder", given, f"a folder, or one of {', '.join(_names())}{why}")


def _text(folder: Traversable, file: str, name_or_folder: str | Path) -> str:
    path = folder / file
    return Reader(str(path), RobotFault).text(path, f"this file in the robot's folder {name_or_folder}")
