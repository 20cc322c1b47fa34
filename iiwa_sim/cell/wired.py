"""The scene of cell.toml, and its wires to inputs and outputs. The reference for users is docs/cells.md."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from iiwa_sim.cell.handled import GripperSettings
from iiwa_sim.controller.handling import SENSORS
from iiwa_sim.controller.wires import InputWire, OutputWire
from iiwa_sim.settings import Range, Reader, SettingsFault

if TYPE_CHECKING:
    from iiwa_sim.world.scene import Scene

WIRE_RANGE: Range = (-1e6, 1e6, "")
"""Range of numbers for sensors and actuators."""


class SceneSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    file: str

    def read(self, reader: Reader, folder: Path, fault: type[SettingsFault], names: Sequence[str]) -> Scene:
        """Read the scene, relative to the folder of the cell; `names` are those of surfaces and parts."""
        from iiwa_sim.world.scene import Scene, SceneFault

        file = folder / self.file
        there = self.file != "" and file.is_file()
        reader.check("scene.file", self.file, there, f"the path of an MJCF file in {folder.resolve()}")
        try:
            scene = Scene(file)
        except SceneFault as why:
            raise fault(str(file), "", "", f"a scene that MuJoCo takes: {why}") from None
        taken = next((name for name in names if name in scene.body_names), None)
        reader.check(
            "scene.file", self.file, taken is None, f"no body {taken!r}: a surface or part has that name"
        )
        return scene


class InputSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An input that is on while a sensor reads more, or less, than a number."""

    number: int
    sensor: str
    above: float | None = None
    below: float | None = None


class OutputSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An output and the numbers by which it drives an actuator, a conveyor or an equality."""

    number: int
    actuator: str
    on: float = 1.0
    off: float = 0.0


def check_wires(
    reader: Reader,
    wired: tuple[Sequence[InputSettings], Sequence[OutputSettings]],
    gripper: GripperSettings | None,
    counts: tuple[int, int],
    has_scene: bool,
) -> None:
    """Raises an error for wires of a cell without a scene, and for numbers that are out of range or taken.

    `counts` are the numbers of inputs and outputs.
    """
    taken = {
        number: f"gripper.{name}_input"
        for name in SENSORS
        if gripper is not None and (number := getattr(gripper, f"{name}_input")) is not None
    }
    inputs, outputs = wired
    for index, each in enumerate(inputs):
        key = _check_wire(reader, f"input[{index}]", each.number, counts[0], has_scene)
        other = taken.setdefault(each.number, key)
        reader.check(f"{key}.number", each.number, other == key, f"another input than that of {other}")
        limits = {name: value for name in ("above", "below") if (value := getattr(each, name)) is not None}
        reader.check(f"{key}.above", each.above, len(limits) > 0, "this key, or below")
        for name, value in limits.items():
            reader.check_range(f"{key}.{name}", value, WIRE_RANGE)
    driven: dict[str, str] = {}
    for index, wire in enumerate(outputs):
        key = _check_wire(reader, f"output[{index}]", wire.number, counts[1], has_scene)
        other = driven.setdefault(wire.actuator, key)
        reader.check(f"{key}.actuator", wire.actuator, other == key, f"another actuator than that of {other}")
        reader.check_range(f"{key}.on", wire.on, WIRE_RANGE)
        reader.check_range(f"{key}.off", wire.off, WIRE_RANGE)


def _check_wire(reader: Reader, key: str, number: int, count: int, has_scene: bool) -> str:
    kind = key.partition("[")[0]
    reader.check(key, number, has_scene, "a [scene], to which it is wired")
    there = f"one of the {kind}s 1 to {count}" if count else f"none: [io] has no {kind}s"
    reader.check(f"{key}.number", number, 1 <= number <= count, there)
    return key


def wires_of(
    reader: Reader, scene: Scene, inputs: Sequence[InputSettings], outputs: Sequence[OutputSettings]
) -> tuple[tuple[InputWire, ...], tuple[OutputWire, ...]]:
    """Wire a robot to a scene; raises an error for names that this does not have."""
    for index, each in enumerate(inputs):
        _check_named(reader, f"input[{index}].sensor", each.sensor, scene.sensors, "a sensor")
    for index, wire in enumerate(outputs):
        kinds = "an actuator, an equality, or a geom with surfacevel,"
        _check_named(reader, f"output[{index}].actuator", wire.actuator, scene.drivable, kinds)
    return (
        tuple(
            InputWire(
                each.number,
                *scene.sensor(each.sensor),
                -inf if each.above is None else each.above,
                inf if each.below is None else each.below,
            )
            for each in inputs
        ),
        tuple(OutputWire(each.number, *scene.driven(each.actuator), each.on, each.off) for each in outputs),
    )


def _check_named(reader: Reader, key: str, name: str, names: Sequence[str], kinds: str) -> None:
    near = get_close_matches(name, names, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(names)}" if names else "it has none"
    reader.check(key, name, name in names, f"{kinds} of the scene: {hint}")
