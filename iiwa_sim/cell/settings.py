"""cell.toml: its keys and their ranges. The reference for users is docs/cells.md."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Annotated, Literal

import msgspec

from iiwa_sim.cell.bodies import (
    AnySurface,
    BoxSettings,
    CylinderSettings,
    PartSettings,
    PlaneSettings,
    SphereSettings,
    metres,
)
from iiwa_sim.controller.carrying import Tool, ToolLoad
from iiwa_sim.controller.handling import NOTHING, Wiring
from iiwa_sim.controller.io import DEFAULT_COUNT
from iiwa_sim.controller.limits_watch import GREATEST, Safety
from iiwa_sim.protocols.ports import MAX_PORT
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.robot.description import DEFAULT_ROBOT, Angle, CapsuleMm, Length, ToolSettings
from iiwa_sim.settings import Name, SettingsFault, between, expecting, require
from iiwa_sim.world.gripper import Cup, Jaws

DEFAULT_CONTACT_RADIUS_MM = 5.0
LARGEST_IO_COUNT = 499
"""Most inputs or outputs: `get outputs` lists them in a reply of 1,000 bytes."""
MOST_ROBOTS, MOST_PARTS = 28, 256
MOST_CAPSULES = 16
"""Most capsules of a tool: all of them are looked at where the arm touches something."""

_Home = Annotated[Literal["home"], expecting("joint positions in degrees, or 'home'")]
_Size = Annotated[float, between(0.1, 1000.0, " mm")]
_Noise = Annotated[float, between(0.0, 1000.0)]
_Moment = Annotated[float, between(-1000.0, 1000.0, " kg m^2")]
_Sensed = Annotated[float, between(-1e6, 1e6)]
_Number = Annotated[int, between(1, LARGEST_IO_COUNT)]
_Protocol = Annotated[Literal["iiwa", "krc4"], expecting("iiwa, krc4, or a list of both")]
_Port = Annotated[int, between(0, MAX_PORT)]
_ROBOTS = expecting(
    f"a robot's name or folder, or 1 to {MOST_ROBOTS} robots", min_length=1, max_length=MOST_ROBOTS
)
_Ios = (
    Annotated[int, between(0, LARGEST_IO_COUNT)]
    | Annotated[list[Name], expecting(f"at most {LARGEST_IO_COUNT} names", max_length=LARGEST_IO_COUNT)]
)


class CellFault(SettingsFault):
    """A cell cannot be used as its file describes it."""


def _require_different(values: Mapping[str, object], what: str) -> None:
    """Reject a value that is there twice; values come with their keys."""
    taken: dict[object, str] = {}
    for key, value in values.items():
        other = taken.setdefault(value, key)
        require(other == key, key, f"another {what} than that of {other}")


class NoiseSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    seed: Annotated[int, between(0, 999_999_999)] = 0
    force_n: _Noise = 0.0
    torque_nm: _Noise = 0.0
    joint_torque_nm: _Noise = 0.0


class SafetySettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of protective stops besides the joint torques."""

    collision_force_n: Annotated[float, between(0.1, GREATEST, " N")] = inf
    collision_torque_nm: Annotated[float, between(0.1, GREATEST, " Nm")] = inf
    tcp_speed_mm_per_s: Annotated[float, between(1.0, 100_000.0, " mm/s")] = inf
    box_min_mm: tuple[Length, Length, Length] = (-inf, -inf, -inf)
    box_max_mm: tuple[Length, Length, Length] = (inf, inf, inf)

    def safety(self) -> Safety:
        """Return the limits for the controller, in SI units."""
        box = metres(self.box_min_mm), metres(self.box_max_mm)
        return Safety(self.collision_force_n, self.collision_torque_nm, 1e-3 * self.tcp_speed_mm_per_s, box)


class IoSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    inputs: _Ios = DEFAULT_COUNT
    outputs: _Ios = DEFAULT_COUNT

    def names(self, kind: str) -> tuple[str, ...]:
        """Return the names of inputs or outputs; `kind` is input or output."""
        given: int | list[str] = getattr(self, f"{kind}s")
        return tuple([f"{kind} {n}" for n in range(1, given + 1)] if isinstance(given, int) else given)


class CarriedToolSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Tool at the flange: mass, centre of mass, inertia and shape."""

    mass_kg: Annotated[float, between(0.001, 1000.0, " kg")]
    centre_mm: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    inertia_kgm2: tuple[_Moment, _Moment, _Moment, _Moment, _Moment, _Moment] = (0.0,) * 6
    capsules_mm: Annotated[
        tuple[CapsuleMm, ...], expecting(f"at most {MOST_CAPSULES} capsules", max_length=MOST_CAPSULES)
    ] = ()

    def tool(self) -> Tool:
        """Return the tool for the controller, in SI units."""
        capsules = tuple(map(Capsule.of_mm, self.capsules_mm))
        return Tool(ToolLoad(self.mass_kg, metres(self.centre_mm)), self.inertia_kgm2, capsules)


class GripperSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Two jaws or a suction cup, with their outputs and inputs."""

    kind: Annotated[Literal["jaws", "suction"], expecting("'jaws' or 'suction'")] = "jaws"
    stroke_mm: _Size | None = None
    speed_mm_per_s: Annotated[float, between(0.1, 10_000.0, " mm/s")] | None = None
    grip_force_n: Annotated[float, between(0.1, 100_000.0, " N")]
    close_output: _Number
    open_output: _Number = NOTHING
    open_input: _Number = NOTHING
    closed_input: _Number = NOTHING
    holds_input: _Number = NOTHING
    pad_mm: tuple[_Size, _Size] = (20.0, 20.0)
    jaw_mm: tuple[_Size, _Size, _Size] = (20.0, 8.0, 50.0)
    cup_radius_mm: _Size = 10.0

    def __post_init__(self) -> None:
        is_cup = self.kind == "suction"
        for key in ("stroke_mm", "speed_mm_per_s"):
            expected = "nothing with suction" if is_cup else "a number"
            require((getattr(self, key) is None) == is_cup, key, expected)

    def gripper(self) -> tuple[Jaws | Cup, Wiring]:
        """Return the gripper for the controller, in SI units."""
        wiring = Wiring(*(getattr(self, key) for key in Wiring._fields))
        if self.stroke_mm is None or self.speed_mm_per_s is None:
            return Cup(self.grip_force_n, 1e-3 * self.cup_radius_mm), wiring
        wide_m, long_m = (1e-3 * each for each in self.pad_mm)
        stroke_m, speed_m = 1e-3 * self.stroke_mm, 1e-3 * self.speed_mm_per_s
        return Jaws(stroke_m, speed_m, self.grip_force_n, wide_m, long_m, metres(self.jaw_mm)), wiring


class SceneSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    file: str


class InputSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An input that is on while a sensor reads more, or less, than a number."""

    number: _Number
    sensor: str
    above: _Sensed = -inf
    below: _Sensed = inf

    def __post_init__(self) -> None:
        require(self.above > -inf or self.below < inf, "above", "this key, or below")


class OutputSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An output and the numbers by which it drives an actuator, a conveyor or an equality."""

    number: _Number
    actuator: str
    on: _Sensed = 1.0
    off: _Sensed = 0.0


class OneRobotSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The keys of a robot in its cell: at the top level for the only one, else in its `[[robot]]`."""

    start_deg: _Home | list[float] = "home"
    contact_radius_mm: Annotated[float, between(0.0, 500.0, " mm")] = DEFAULT_CONTACT_RADIUS_MM
    tool_in_flange: ToolSettings | None = None
    tool: CarriedToolSettings | None = None
    gripper: GripperSettings | None = None
    input: list[InputSettings] = []
    output: list[OutputSettings] = []
    io: IoSettings = IoSettings()
    safety: SafetySettings = SafetySettings()

    def __post_init__(self) -> None:
        """Check that each wired input and output is there, and each input wired once."""
        wires: dict[str, tuple[str, int]] = {}
        if self.gripper is not None:
            wiring = {key: getattr(self.gripper, key) for key in Wiring._fields}
            wires = {f"gripper.{key}": (key.split("_")[1], n) for key, n in wiring.items() if n != NOTHING}
        wires |= {f"input[{k}].number": ("input", each.number) for k, each in enumerate(self.input)}
        _require_different(wires, "number")
        wires |= {f"output[{k}].number": ("output", each.number) for k, each in enumerate(self.output)}
        for key, (kind, number) in wires.items():
            count = len(self.io.names(kind))
            there = f"one of the {kind}s 1 to {count}" if count else f"none: [io] has no {kind}s"
            require(number <= count, key, there)


class RobotSettings(OneRobotSettings, frozen=True, kw_only=True):
    """A `[[robot]]`; the pose is that of its base in the world."""

    name: Annotated[str, expecting("up to 40 letters, digits, - and _", pattern=r"^[A-Za-z0-9_-]{1,40}\Z")]
    model: str = DEFAULT_ROBOT
    protocol: _Protocol | Annotated[list[_Protocol], msgspec.Meta(min_length=1)] = "iiwa"
    port: _Port | list[_Port] = 0
    x_mm: Length = 0.0
    y_mm: Length = 0.0
    z_mm: Length = 0.0
    alpha: Angle = 0.0
    beta: Angle = 0.0
    gamma: Angle = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.ports()

    def ports(self) -> dict[str, int]:
        """Return the port of each protocol; 0 for a free one."""
        protocols = [self.protocol] if isinstance(self.protocol, str) else list(dict.fromkeys(self.protocol))
        ports = [self.port] if isinstance(self.port, int) else self.port
        ports = [0] * len(protocols) if self.port == 0 else ports
        require(len(ports) == len(protocols), "port", "one port for each protocol, or 0")
        return dict(zip(protocols, ports, strict=True))


class CellSettings(OneRobotSettings, frozen=True, kw_only=True):
    robot: str | Annotated[list[RobotSettings], _ROBOTS] = DEFAULT_ROBOT
    scene: SceneSettings | None = None
    part: Annotated[list[PartSettings], expecting(f"at most {MOST_PARTS} parts", max_length=MOST_PARTS)] = []
    plane: list[PlaneSettings] = []
    box: list[BoxSettings] = []
    sphere: list[SphereSettings] = []
    cylinder: list[CylinderSettings] = []
    noise: NoiseSettings | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        bodies = {**self.surfaces(), **{f"part[{index}]": part for index, part in enumerate(self.part)}}
        _require_different({f"{place}.name": body.name for place, body in bodies.items()}, "name")
        if isinstance(self.robot, str):
            return
        for key in OneRobotSettings.__struct_fields__:
            alone = getattr(self, key) == getattr(OneRobotSettings(), key)
            require(alone, key, f"none beside [[robot]]: each robot has its own, robot.{key}")
        names = {f"robot[{index}].name": robot.name for index, robot in enumerate(self.robot)}
        _require_different(names, "name")

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
