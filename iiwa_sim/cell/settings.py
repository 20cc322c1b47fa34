"""cell.toml: its keys and their ranges. The reference for users is docs/cells.md."""

from __future__ import annotations

import re
from operator import attrgetter

import msgspec
import numpy as np

from iiwa_sim.cell.handled import (
    GRIPPER_RANGES,
    AnyPart,
    GripperSettings,
    check_gripper,
    check_parts,
)
from iiwa_sim.cell.placed import POSE_RANGES, check_ranges
from iiwa_sim.cell.surfaces import (
    AnySurface,
    BoxSettings,
    CylinderSettings,
    PlaneSettings,
    SphereSettings,
    check_surfaces,
)
from iiwa_sim.cell.wired import InputSettings, OutputSettings, SceneSettings, check_wires
from iiwa_sim.contact.payload import body
from iiwa_sim.controller.carrying import Tool, ToolLoad
from iiwa_sim.controller.io import DEFAULT_COUNT
from iiwa_sim.controller.limits_watch import GREATEST, Safety
from iiwa_sim.frames import Frame, Transform, Vector
from iiwa_sim.protocols.ports import DEFAULT_PORTS, IIWA, MAX_PORT
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.robot.description import DEFAULT_ROBOT, LENGTH, ToolSettings
from iiwa_sim.settings import Range, Reader, SettingsFault

HOME = "home"
DEFAULT_CONTACT_RADIUS_MM = 5.0
LARGEST_IO_COUNT = 499
"""Most inputs or outputs: `get outputs` lists them in a reply of 1,000 bytes."""

MOST_ROBOTS = 32

_INERTIA: Range = (-1000.0, 1000.0, " kg m^2")
ROBOT_RANGES: dict[str, Range] = {
    "contact_radius_mm": (0.0, 500.0, " mm"),
    **{f"tool_in_flange.{key}": allowed for key, allowed in POSE_RANGES.items()},
    "tool.mass_kg": (0.001, 1000.0, " kg"),
    **GRIPPER_RANGES,
    "safety.collision_force_n": (0.1, GREATEST, " N"),
    "safety.collision_torque_nm": (0.1, GREATEST, " Nm"),
    "safety.tcp_speed_mm_per_s": (1.0, 100_000.0, " mm/s"),
}
"""Least and greatest value, and the unit."""
NOISE_RANGES: dict[str, Range] = {
    "noise.seed": (0, 999_999_999, ""),
    "noise.force_n": (0.0, 1000.0, " N"),
    "noise.torque_nm": (0.0, 1000.0, " Nm"),
    "noise.joint_torque_nm": (0.0, 1000.0, " Nm"),
}


class CellFault(SettingsFault):
    """A cell cannot be used as its file describes it.

    The message is one line that names the file, the key, its value and what was expected.
    """


MOST_CAPSULES = 16
"""Most capsules of a tool: all of them are looked at where the arm touches something."""
_RADIUS = (0.1, 1000.0, " mm")


class NoiseSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    seed: int = 0
    force_n: float = 0.0
    torque_nm: float = 0.0
    joint_torque_nm: float = 0.0


class SafetySettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of protective stops besides the joint torques."""

    collision_force_n: float | None = None
    collision_torque_nm: float | None = None
    tcp_speed_mm_per_s: float | None = None
    box_min_mm: tuple[float, float, float] | None = None
    box_max_mm: tuple[float, float, float] | None = None

    def safety(self) -> Safety:
        """Return the limits for the controller, in SI units."""
        speed_mm, low_mm, high_mm = self.tcp_speed_mm_per_s, self.box_min_mm, self.box_max_mm
        return Safety(
            self.collision_force_n,
            self.collision_torque_nm,
            None if speed_mm is None else 1e-3 * speed_mm,
            None if low_mm is None or high_mm is None else (metres(low_mm), metres(high_mm)),
        )


class IoSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    inputs: int | list[str] = DEFAULT_COUNT
    outputs: int | list[str] = DEFAULT_COUNT

    def input_names(self) -> tuple[str, ...]:
        return _names("input", self.inputs)

    def output_names(self) -> tuple[str, ...]:
        return _names("output", self.outputs)


class CarriedToolSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Tool at the flange: mass, centre of mass, inertia and shape."""

    mass_kg: float
    centre_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia_kgm2: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    capsules_mm: tuple[tuple[float, float, float, float, float, float, float], ...] = ()

    def tool(self) -> Tool:
        """Return the tool for the controller, in SI units."""
        capsules = tuple(map(Capsule.of_mm, self.capsules_mm))
        return Tool(ToolLoad(self.mass_kg, metres(self.centre_mm)), self.inertia_kgm2, capsules)


class OneRobotSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The keys of a robot in its cell: at the top level for the only one, else in its `[[robot]]`."""

    start_deg: str | list[float] = HOME
    contact_radius_mm: float = DEFAULT_CONTACT_RADIUS_MM
    tool_in_flange: ToolSettings | None = None
    tool: CarriedToolSettings | None = None
    gripper: GripperSettings | None = None
    input: list[InputSettings] = []
    output: list[OutputSettings] = []
    io: IoSettings = IoSettings()
    safety: SafetySettings = SafetySettings()


class RobotSettings(OneRobotSettings, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A `[[robot]]`; the pose is that of its base in the world."""

    name: str
    model: str = DEFAULT_ROBOT
    protocol: str | list[str] = IIWA
    port: int | list[int] = 0
    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    gamma: float = 0.0

    def base(self) -> Transform:
        """The pose of the base in the world (m)."""
        return Frame(self.x_mm, self.y_mm, self.z_mm, self.alpha, self.beta, self.gamma).to_transform()

    def ports(self) -> dict[str, int]:
        """Return the port of each protocol; 0 for a free one."""
        protocols = [self.protocol] if isinstance(self.protocol, str) else self.protocol
        ports = [self.port] * len(protocols) if isinstance(self.port, int) else self.port
        return dict(zip(protocols, ports, strict=True))


class CellSettings(OneRobotSettings, frozen=True, forbid_unknown_fields=True, kw_only=True):
    robot: str | list[RobotSettings] = DEFAULT_ROBOT
    scene: SceneSettings | None = None
    part: list[AnyPart] = []
    plane: list[PlaneSettings] = []
    box: list[BoxSettings] = []
    sphere: list[SphereSettings] = []
    cylinder: list[CylinderSettings] = []
    noise: NoiseSettings | None = None

    def robots(self) -> dict[str, OneRobotSettings]:
        """Return the robots, each with the beginning of its keys in the file."""
        if isinstance(self.robot, str):
            return {"": self}
        return {f"robot[{index}].": robot for index, robot in enumerate(self.robot)}

    def surfaces(self) -> dict[str, AnySurface]:
        """Return the surfaces, each with its key in the file."""
        return {
            f"{kind}[{index}]": surface
            for kind in ("plane", "box", "sphere", "cylinder")
            for index, surface in enumerate(getattr(self, kind))
        }


def read_settings(path: str, text: str) -> CellSettings:
    """The settings in the text of a cell.toml; raises `CellFault`."""
    reader = Reader(path, CellFault)
    settings = reader.settings(text, CellSettings)
    _check_ranges(reader, settings, NOISE_RANGES)
    check_surfaces(reader, settings.surfaces())
    for prefix, robot in settings.robots().items():
        _check_robot(reader.under(prefix), robot, settings.scene is not None)
    if not isinstance(settings.robot, str):
        _check_robots(reader, settings, settings.robot)
    check_parts(reader, settings.part, [each.name for each in settings.surfaces().values()])
    return settings


def _check_ranges(reader: Reader, settings: msgspec.Struct, ranges: dict[str, Range]) -> None:
    for key, allowed in ranges.items():
        table = key.rpartition(".")[0]
        if (not table or attrgetter(table)(settings) is not None) and (
            value := attrgetter(key)(settings)
        ) is not None:
            reader.check_range(key, value, allowed)


def _check_robot(reader: Reader, robot: OneRobotSettings, has_scene: bool) -> None:
    _check_ranges(reader, robot, ROBOT_RANGES)
    _check_tool(reader, robot.tool)
    _check_box(reader, robot.safety)
    _check_io(reader, "io.inputs", robot.io.inputs)
    _check_io(reader, "io.outputs", robot.io.outputs)
    inputs, outputs = len(robot.io.input_names()), len(robot.io.output_names())
    check_gripper(reader, robot.gripper, inputs, outputs)
    check_wires(reader, (robot.input, robot.output), robot.gripper, (inputs, outputs), has_scene)


def _check_robots(reader: Reader, settings: CellSettings, robots: list[RobotSettings]) -> None:
    """Raises an error for keys of a single robot beside `[[robot]]`, and for names and ports that are wrong
    or taken."""
    for key in OneRobotSettings.__struct_fields__:
        given = getattr(settings, key)
        alone = given == getattr(OneRobotSettings(), key)
        expected = f"none beside [[robot]]: each robot has its own, robot.{key}"
        reader.check(key, msgspec.to_builtins(given), alone, expected)
    reader.check("robot", "none", 1 <= len(robots) <= MOST_ROBOTS, f"1 to {MOST_ROBOTS} robots")
    names: dict[str, str] = {}
    taken: dict[int, str] = {}
    for index, robot in enumerate(robots):
        place = f"robot[{index}]"
        is_name = re.fullmatch(r"[A-Za-z0-9_-]{1,40}", robot.name) is not None
        reader.check(f"{place}.name", robot.name, is_name, "up to 40 letters, digits, - and _")
        other = names.setdefault(robot.name, place)
        reader.check(f"{place}.name", robot.name, other == place, f"another name than that of {other}")
        check_ranges(reader, f"{place}.", robot, POSE_RANGES)
        spoken = [robot.protocol] if isinstance(robot.protocol, str) else robot.protocol
        known = bool(spoken) and len({*spoken} & DEFAULT_PORTS.keys()) == len(spoken)
        reader.check(f"{place}.protocol", robot.protocol, known, "iiwa, krc4, or a list of both")
        ports = robot.port if isinstance(robot.port, list) else [robot.port]
        one = "0, or a list of one for each protocol" if len(spoken) > 1 else "one port"
        reader.check(f"{place}.port", robot.port, len(ports) == len(spoken) or ports == [0], one)
        for port in ports:
            reader.check_range(f"{place}.port", port, (0, MAX_PORT, ""))
            other = taken.setdefault(port, robot.name) if port else robot.name
            reader.check(
                f"{place}.port",
                port,
                port == 0 or (other == robot.name and ports.count(port) == 1),
                f"another port than that of {other!r}",
            )


def _check_tool(reader: Reader, tool: CarriedToolSettings | None) -> None:
    """Raises an error for a centre out of range, and for an inertia that no body has: of each principal
    axis it is at most as great as those of the other two together."""
    if tool is None:
        return
    for axis, value in enumerate(tool.centre_mm):
        reader.check_range(f"tool.centre_mm[{axis}]", value, LENGTH)
    count = len(tool.capsules_mm)
    reader.check("tool.capsules_mm", f"{count} of them", count <= MOST_CAPSULES, f"at most {MOST_CAPSULES}")
    for number, capsule in enumerate(tool.capsules_mm):
        for place, value in enumerate(capsule):
            allowed = LENGTH if place < 6 else _RADIUS
            reader.check_range(f"tool.capsules_mm[{number}][{place}]", value, allowed)
    for place, value in enumerate(tool.inertia_kgm2):
        reader.check_range(f"tool.inertia_kgm2[{place}]", value, _INERTIA)
    spread = body(1.0, (0.0, 0.0, 0.0), tool.inertia_kgm2)
    least = float(np.linalg.eigvalsh(spread[:3, :3])[0])
    can_be = least >= -1e-9 * max(map(abs, tool.inertia_kgm2))
    expected = "ixx, iyy, izz, ixy, ixz, iyz of a body: no principal one above the sum of the others"
    reader.check("tool.inertia_kgm2", list(tool.inertia_kgm2), can_be, expected)


def _check_box(reader: Reader, safety: SafetySettings) -> None:
    low, high = safety.box_min_mm, safety.box_max_mm
    for key, given, other in (("box_min_mm", low, high), ("box_max_mm", high, low)):
        missing = given is None and other is not None
        reader.check(f"safety.{key}", None, not missing, "both corners of the box, or none")
        for axis, value in enumerate(given or ()):
            reader.check_range(f"safety.{key}[{axis}]", value, LENGTH)
    if low is not None and high is not None:
        for axis in range(3):
            above = f"more than {low[axis]:g} mm, box_min_mm there"
            reader.check(f"safety.box_max_mm[{axis}]", high[axis], high[axis] > low[axis], above)


def _check_io(reader: Reader, key: str, given: int | list[str]) -> None:
    if isinstance(given, int):
        reader.check_range(key, given, (0, LARGEST_IO_COUNT, " of them"))
        return
    reader.check(key, given, len(given) <= LARGEST_IO_COUNT, f"at most {LARGEST_IO_COUNT} names")
    for index, name in enumerate(given):
        reader.check_name(f"{key}[{index}]", name)
        reader.check(f"{key}[{index}]", name, name not in given[:index], "each name once")


def metres(place_mm: Vector) -> Vector:
    """Return a place told in mm (m)."""
    x, y, z = place_mm
    return 1e-3 * x, 1e-3 * y, 1e-3 * z


def _names(kind: str, given: int | list[str]) -> tuple[str, ...]:
    if isinstance(given, int):
        return tuple(f"{kind} {number}" for number in range(1, given + 1))
    return tuple(given)
