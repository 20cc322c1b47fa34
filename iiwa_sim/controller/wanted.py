"""What motions are asked for, as values: stiffness moves, targets of servos, trajectories, holds."""

from typing import NamedTuple

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.joint_trajectory import JointTrajectory
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.springs import CartesianImpedance


class Target(NamedTuple):
    """Where a servo heads for, and within which limits."""

    number: int
    """Moves, targets and holds are numbered together, in the order in which they were accepted."""
    end: Joints
    """Joint positions (rad) of the target."""
    limits: JointLimits

    @property
    def planned(self) -> "Planned":
        """Where the servo is to go."""
        return Planned(self.number, self.end, 0.0)


class Planned(NamedTuple):
    """Where a move, or a servo, is to go."""

    number: int
    """Number of the move, as with `Target`."""
    joints: Joints
    """Joint positions (rad) at its end."""
    blending_m: float
    """Radius of the sphere round the TCP there in which it may leave its path for the next one; 0 for none,
    also where joint positions say how far it may."""


class StiffnessMove(NamedTuple):
    """A move around which the robot gives way."""

    move: Move
    impedance: CartesianImpedance

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at the end of the move."""
        return self.move.path.end

    @property
    def planned(self) -> Planned:
        """Where the move is to go."""
        return planned_of(self.move)


class Hold(NamedTuple):
    """A gravity hold: springs that keep every joint where it is."""

    number: int
    stiffness_nm_per_rad: float


class Tracked(NamedTuple):
    """A joint trajectory, and how the robot follows it."""

    number: int
    way: JointTrajectory

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at the end of the trajectory."""
        return self.way.reference.end

    @property
    def planned(self) -> Planned:
        """Where the servo is to go."""
        return Planned(self.number, self.end, 0.0)


def planned_of(move: Move) -> Planned:
    """Where a move is to go."""
    blending_m = move.zone.radius if move.zone is not None and move.zone.of_tcp else 0.0
    return Planned(move.number, move.path.end, blending_m)
