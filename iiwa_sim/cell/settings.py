"""cell.toml: its keys and their ranges. The reference for users is docs/cells.md."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Annotated, Literal

import msgspec
import numpy as np

from iiwa_sim.cell.bodies import (
    AnySurface,
    BoxSettings,
    CylinderSettings,
    PartSettings,
    PlaneSettings,
    SphereSettings,
    metres,
)
from iiwa_sim.contact.payload import body
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
MOST_ROBOTS, MOST_PARTS = 32, 256
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
_Ios = (
    Annotated[int, between(0, LARGEST_IO_COUNT)]
    | Annotated[list[Name], expecting(f"at most {LARGEST_IO_COUNT} names", max_length=LARGEST_IO_COUNT)]
)


class CellFault(SettingsFault):
    """A cell cannot be used as its file describes it.

    The message is one line that names the file, the key, its value and what was expected.
    """


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

    def __post_init__(self) -> None:
        for axis, (least, most) in enumerate(zip(self.box_min_mm, self.box_max_mm, strict=True)):
            require(least < most, f"box_max_mm[{axis}]", f"more than {least:g} mm, box_min_mm there")

    def safety(self) -> Safety:
        """Return the limits for the controller, in SI units."""
        return Safety(
            self.collision_force_n,
            self.collision_torque_nm,
            1e-3 * self.tcp_speed_mm_per_s,
            (metres(self.box_min_mm), metres(self.box_max_mm)),
        )


class IoSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    inputs: _Ios = DEFAULT_COUNT
    outputs: _Ios = DEFAULT_COUNT

    def __post_init__(self) -> None:
        for kind in ("input", "output"):
            names = {f"{kind}s[{index}]": name for index, name in enumerate(self.names(kind))}
            _require_different(names, "name")

    def names(self, kind: str) -> tuple[str, ...]:
        """Return the names of inputs or outputs; `kind` is input or output."""
        given: int | list[str] = getattr(self, f"{kind}s")
        numbered = range(1, given + 1) if isinstance(given, int) else ()
        return tuple(f"{kind} {number}" for number in numbered) if isinstance(given, int) else tuple(given)


class CarriedToolSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Tool at the flange: mass, centre of mass, inertia and shape."""

    mass_kg: Annotated[float, between(0.001, 1000.0, " kg")]
    centre_mm: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    inertia_kgm2: tuple[_Moment, _Moment, _Moment, _Moment, _Moment, _Moment] = (0.0,) * 6
    capsules_mm: Annotated[
        tuple[CapsuleMm, ...], expecting(f"at most {MOST_CAPSULES} capsules", max_length=MOST_CAPSULES)
    ] = ()

    def __post_init__(self) -> None:
        """Check the inertia: a principal one is at most as great as the others together."""
        spread = body(1.0, (0.0, 0.0, 0.0), self.inertia_kgm2)
        least = float(np.linalg.eigvalsh(spread[:3, :3])[0])
        expected = "ixx, iyy, izz, ixy, ixz, iyz of a body: no principal one above the sum of the others"
        require(least >= -1e-9 * max(map(abs, self.inertia_kgm2)), "inertia_kgm2", expected)

    def tool(self) -> Tool:
        """Return the tool for the controller, in SI units."""
        capsules = tuple(map(Capsule.of_mm, self.capsules_mm))
        return Tool(ToolLoad(self.mass_kg, metres(self.centre_mm)), self.inertia_kgm2, capsules)


class GripperSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Two jaws or a suction cup, and what switches and tells of them."""

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
        expected = "nothing with suction" if is_cup else "a number"
        require((self.stroke_mm is None) == is_cup, "stroke_mm", expected)
        require((self.speed_mm_per_s is None) == is_cup, "speed_mm_per_s", expected)

    def gripper(self) -> tuple[Jaws | Cup, Wiring]:
        """Return the gripper for the controller, in SI units."""
        wiring = Wiring(
            self.close_output, self.open_output, self.open_input, self.closed_input, self.holds_input
        )
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
        """Check that each wired input and output is there, and each input and actuator wired once."""
        wires: dict[str, tuple[str, int]] = {}
        if self.gripper is not None:
            wiring = {key: getattr(self.gripper, key) for key in Wiring._fields}
            wires = {f"gripper.{key}": (key.split("_")[1], n) for key, n in wiring.items() if n != NOTHING}
        wires |= {f"input[{k}].number": ("input", each.number) for k, each in enumerate(self.input)}
        _require_different(wires, "number")
        driven = {f"output[{k}].actuator": each.actuator for k, each in enumerate(self.output)}
        _require_different(driven, "actuator")
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
        count, ports = len(self._protocols()), 1 if isinstance(self.port, int) else len(self.port)
        expected = "0, or a list of one for each protocol" if count > 1 else "one port"
        require(ports == count or self.port == 0, "port", expected)

    def _protocols(self) -> list[str]:
        return [self.protocol] if isinstance(self.protocol, str) else list(dict.fromkeys(self.protocol))

    def ports(self) -> dict[str, int]:
        """Return the port of each protocol; 0 for a free one."""
        protocols = self._protocols()
        ports = [self.port] * len(protocols) if isinstance(self.port, int) else self.port
        return dict(zip(protocols, ports, strict=True))


class CellSettings(OneRobotSettings, frozen=True, kw_only=True):
    robot: (
        str
        | Annotated[
            list[RobotSettings],
            expecting(
                f"a robot's name or folder, or 1 to {MOST_ROBOTS} robots",
                min_length=1,
                max_length=MOST_ROBOTS,
            ),
        ]
    ) = DEFAULT_ROBOT
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
        for prefix, robot in self.robots().items():
            for kind in ("input", "output"):
                fits = self.scene is not None or not getattr(robot, kind)
                require(fits, f"{prefix}{kind}[0]", "a [scene], to which it is wired")
        if isinstance(self.robot, str):
            return
        for key in OneRobotSettings.__struct_fields__:
            alone = getattr(self, key) == getattr(OneRobotSettings(), key)
            require(alone, key, f"none beside [[robot]]: each robot has its own, robot.{key}")
        names = {f"robot[{index}].name": robot.name for index, robot in enumerate(self.robot)}
        _require_different(names, "name")
        taken: dict[int, tuple[str, str]] = {}
        for index, robot in enumerate(self.robot):
            for protocol, port in robot.ports().items():
                other = taken.setdefault(port, own := (robot.name, protocol))
                is_free = port == 0 or other == own
                require(is_free, f"robot[{index}].port", f"another port than that of {other[0]!r}")

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
