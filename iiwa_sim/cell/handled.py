"""What a robot works with, as cell.toml has it. The reference for users is docs/gripper.md."""

from __future__ import annotations

import msgspec

from iiwa_sim.controller.handling import NOTHING, SENSORS, Wiring
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.settings import Range, Reader

GRIPPER_RANGES: dict[str, Range] = {
    "gripper.stroke_mm": (0.1, 1000.0, " mm"),
    "gripper.speed_mm_per_s": (0.1, 10_000.0, " mm/s"),
    "gripper.grip_force_n": (0.1, 100_000.0, " N"),
}
"""Least and greatest value, and the unit."""


class GripperSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Two jaws, and what switches and tells of them."""

    stroke_mm: float
    speed_mm_per_s: float
    grip_force_n: float
    close_output: int
    open_output: int | None = None
    open_input: int | None = None
    closed_input: int | None = None
    holds_input: int | None = None

    def gripper(self) -> tuple[Jaws, Wiring]:
        """What a controller takes."""
        wired = (self.open_output, self.open_input, self.closed_input, self.holds_input)
        return (
            Jaws(1e-3 * self.stroke_mm, 1e-3 * self.speed_mm_per_s, self.grip_force_n),
            Wiring(self.close_output, *(NOTHING if number is None else number for number in wired)),
        )


def check_gripper(reader: Reader, gripper: GripperSettings | None, inputs: int, outputs: int) -> None:
    """Raises an error for numbers that no input or output has, and for one that is wired twice."""
    if gripper is None:
        return
    for kind, count, names in (
        ("output", outputs, ("close", "open")),
        ("input", inputs, SENSORS),
    ):
        taken: dict[int, str] = {}
        for name in names:
            key, number = f"{name}_{kind}", getattr(gripper, f"{name}_{kind}")
            if number is None:
                continue
            reader.check(f"gripper.{key}", number, 1 <= number <= count, f"one of the {kind}s 1 to {count}")
            other = taken.setdefault(number, key)
            reader.check(f"gripper.{key}", number, other == key, f"another {kind} than that of {other}")
