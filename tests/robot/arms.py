"""Helpers of the tests in this folder: arms, random joint positions, distances between poses."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model

IIWAS = ("lbr_iiwa_7_r800", "lbr_iiwa_14_r820")
SIX_AXES = "kr_6_r900_sixx"
BUILT_IN = (*IIWAS, SIX_AXES)


@dataclass(frozen=True)
class Arm:
    description: RobotDescription
    model: Model
    inverse: Inverse

    def anywhere(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return joint positions (count, n) within the limits."""
        d = self.description
        return rng.uniform(d.position_min, d.position_max, (count, len(d.joints)))

    def within_limits(self, q: Sequence[float]) -> bool:
        d = self.description
        return all(low <= a <= high for low, a, high in zip(d.position_min, q, d.position_max, strict=True))


def branches_of(
    arm: Arm, flange: Transform, redundancy: float, seed: Sequence[float]
) -> dict[int, tuple[float, ...]]:
    found = {each: arm.inverse.joints(flange, redundancy, each, seed) for each in arm.inverse.statuses}
    return {status: joints for status, joints in found.items() if joints is not None}


@cache
def arm_named(name: str, flange: str | None = None) -> Arm:
    """With another flange than its robot.toml has, if one is named."""
    description = load_robot(name)
    model = Model(description if flange is None else replace(description, flange=flange))
    return Arm(model.description, model, Inverse(model))


def distance(a: Sequence[Transform], b: Sequence[Transform]) -> float:
    """Return the largest difference of two rows of poses, in m or in a rotation's elements."""
    rotations = np.subtract([t.rotation for t in a], [t.rotation for t in b])
    translations = np.subtract([t.translation for t in a], [t.translation for t in b])
    return float(max(np.abs(rotations).max(), np.abs(translations).max()))


def copy_of_robot(folder: Path, name: str = BUILT_IN[0]) -> Path:
    """Return a copy of a built-in robot's folder, to be changed."""
    folder.mkdir()
    for file in ("robot.toml", "robot.urdf"):
        shutil.copy(str(files("iiwa_sim.robots") / name / file), folder)
    return folder


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


def use(folder: Path | str) -> RobotDescription:
    """Load a robot's folder, with its kinematics."""
    description = load_robot(folder)
    Inverse(Model(description))
    return description
