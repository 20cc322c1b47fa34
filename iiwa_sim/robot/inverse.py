"""The interface of inverse kinematics, common to all arms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.opw import Opw
from iiwa_sim.robot.srs import Srs


class Inverse(Protocol):
    """Joint positions for a pose of the flange in the base (m). Joints and redundancy in rad.

    The status selects a branch; where two merge, at a singular pose, either may be selected. A joint that is
    free there keeps its position in `seed`. Joint limits are not checked; angles are in (-pi, pi], see
    `iiwa_sim.robot.turns`. A robot without redundancy ignores `redundancy`.
    """

    @property
    def model(self) -> Model:
        """The model of the arm."""

    @property
    def kind(self) -> int:
        """The closed form in `iiwa_sim.robot.inverse_kernel`."""

    @property
    def numbers(self) -> NDArray[np.float64]:
        """The dimensions of the arm for that closed form."""

    @property
    def statuses(self) -> Sequence[int]:
        """All statuses."""

    @property
    def redundancy_range(self) -> tuple[float, float] | None:
        """Least and greatest redundancy within the joint limits; None for a robot without redundancy."""

    def joints(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Joint positions on one branch, or None where it does not reach the pose."""

    def beyond_reach(self, flange: Transform) -> float:
        """How far (m) the wrist point is beyond where upper arm and forearm bring it.

        Above 0 where it is too far away, below 0 where it is too near; 0 within reach, whether or not joint
        limits and the redundancy leave a way.
        """

    def branches(
        self, flange: Transform, redundancy: float, seed: Sequence[float]
    ) -> list[tuple[int, tuple[float, ...]]]:
        """Status and joint positions of each branch that reaches the pose."""

    def joints_batch(
        self,
        rotations: NDArray[np.float64],
        translations: NDArray[np.float64],
        redundancies: NDArray[np.float64],
        status: int | NDArray[np.int64],
        seed: Sequence[float],
    ) -> NDArray[np.float64]:
        """Joint positions (N, n) for rotations (N, 3, 3), translations (N, 3) and redundancies (N,).

        The status is one for all or (N,). Rows out of reach are NaN.
        """

    def status(self, q: Sequence[float]) -> int:
        """The branch of joint positions."""

    def merging_statuses(self, q: Sequence[float], near: float = 1e-6) -> Sequence[int]:
        """The statuses of the branches that meet at joint positions, their own first: several at singular
        poses.

        Positions count as singular within `near` (rad, m).
        """

    def turning_point(self, q: Sequence[float]) -> str | None:
        """The kind of singularity at which no straight line can start or end; None elsewhere.

        There, unlike at a stretched wrist, joints go with the square root of the pose, or one of them may
        have to turn at once to follow a line.
        """

    def turn(self, q: Sequence[float]) -> int:
        """Signs of the joint positions: bit i is set where joint i + 1 is negative."""

    def redundancy(self, q: Sequence[float]) -> float:
        """The redundancy of joint positions; 0 for a robot without redundancy."""


def inverse_of(model: Model) -> Inverse:
    """The inverse kinematics of a model's description.

    Raises `RobotFault` for an unknown kind, and if the geometry of the URDF is not of that kind.
    """
    description = model.description
    if description.kinematics == "srs":
        return Srs(model)
    if description.kinematics == "opw":
        return Opw(model)
    raise RobotFault(description.settings_path, "kinematics", repr(description.kinematics), "'srs' or 'opw'")
