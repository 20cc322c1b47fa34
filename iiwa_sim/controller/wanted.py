"""What motions are asked for, as values: stiffness moves, targets of servos, trajectories, holds.

Moves, targets, trajectories and holds are numbered together, in the order in which they were accepted.
"""

from typing import NamedTuple

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.joint_trajectory import JointTrajectory
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.springs import CartesianImpedance


class Target(NamedTuple):
    """Where a servo heads for, and within which limits."""

    number: int
    end: Joints
    """Joint positions (rad)."""
    limits: JointLimits


class StiffnessMove(NamedTuple):
    """A move around which the robot gives way."""

    move: Move
    impedance: CartesianImpedance

    @property
    def number(self) -> int:
        """Number of the move."""
        return self.move.number

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at the end of the move."""
        return self.move.path.end


class Tracked(NamedTuple):
    """A joint trajectory, and how the robot follows it."""

    number: int
    trajectory: JointTrajectory

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at the end."""
        return self.trajectory.end


class Hold(NamedTuple):
    """A gravity hold: springs that keep every joint where it is."""

    number: int
    stiffness_nm_per_rad: float


class Planned(NamedTuple):
    """Where a move, or a servo, is to go."""

    number: int
    joints: Joints
    """Joint positions (rad) at its end."""
    blending_m: float
    """Radius of the sphere around the TCP there in which it may leave its path for the next one; 0 for none,
    also if joint positions say how far it may."""


def planned_of(move: Move) -> Planned:
    """Return where a move is to go."""
    blending_m = move.zone.radius if move.zone is not None and move.zone.of_tcp else 0.0
    return Planned(move.number, move.path.end, blending_m)
