"""What a smart or direct command asks for becomes joint positions and limits, or the reason why not."""

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.errors import EXECUTION, TARGET_NOT_REACHABLE, Refused
from iiwa_sim.controller.lin_planner import ROUNDING_RAD
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.planner import NEAR_RAD, Planner
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.robot.description import RobotDescription

DIRECT_REACH_RAD = 0.087
"""A direct target is no farther from the present position on any axis. Published: the original's."""
LONGEST_APPROACH_S = 3600.0
"""A target that would take longer to reach is refused: its speed is a mistake."""


class Targets:
    """Targets of one robot. Its methods raise `Refused` for one that cannot be headed for.

    The mode, smart or direct, decides about limits of acceleration and jerk, and how near a target has to be.
    """

    def __init__(self, planner: Planner, description: RobotDescription) -> None:
        self._planner = planner
        self._names = description.joints
        self.limits = {
            Mode.SMART: planner.limits,
            Mode.DIRECT: planner.limits._replace(
                acceleration=np.array(description.direct_acceleration),
                jerk=np.array(description.direct_jerk),
            ),
        }
        """The limits of each servo mode, at full speed."""

    def find(
        self, request: MoveRequest, mode: Mode, present: Joints, moving: bool
    ) -> tuple[Joints, JointLimits]:
        """The joint positions (rad) that a servo heads for from the present ones, at rest or `moving`.

        For a frame in the base they are the nearest ones that bring the flange there.
        """
        full = self.limits[mode]
        if isinstance(request.target, Frame):
            target = self._planner.flange_target(present, request.target, request.speed)
            distances = self._distances(mode, present, target)
            limits = full.at_speed(request.speed)
            late = _late(full, limits, distances, moving=moving)
        else:
            target, speeds = self._planner.joint_target(present, request.target, request.speeds)
            distances = self._distances(mode, present, target)
            limits = full.at_speed(speeds)
            late = _late(full, limits, distances, moving=moving)
            # A joint in motion may pass its target. It comes back at full speed, where its own is too low.
            near = distances <= NEAR_RAD + ROUNDING_RAD
            limits = limits._replace(velocity=np.where(late & near, full.velocity, limits.velocity))
            late = late & ~near
        _check_approach(late)
        return target, limits

    def check_way_back(self, limits: JointLimits) -> None:
        """Raises `Refused` where a robot in motion that passes its path might take too long to come back."""
        _check_approach(_late(self.limits[Mode.SMART], limits, np.zeros_like(limits.velocity), moving=True))

    def _distances(self, mode: Mode, present: Joints, target: Joints) -> Array:
        """How far each joint is from its target (rad). Raises `Refused` where that is too far."""
        distances: Array = np.abs(np.subtract(target, present))
        farthest = int(distances.argmax())
        if mode is Mode.DIRECT and distances[farthest] > DIRECT_REACH_RAD + ROUNDING_RAD:
            name, distance = self._names[farthest], distances[farthest]
            raise Refused(
                TARGET_NOT_REACHABLE,
                f"{name} is {distance:.7g} rad from the target: a direct move goes {DIRECT_REACH_RAD:g} rad "
                "at most, a smart move anywhere",
            )
        return distances


def _late(full: JointLimits, limits: JointLimits, distances: Array, *, moving: bool) -> NDArray[np.bool_]:
    """Return which joints might take too long to their targets."""
    # A robot in motion may have to brake first, and to come back the way that takes.
    braking_s = full.velocity / full.acceleration + 2.0 * full.acceleration / full.jerk
    braking = full.velocity * braking_s if moving else 0.0
    late: NDArray[np.bool_] = distances + braking > limits.velocity * LONGEST_APPROACH_S
    return late


def _check_approach(late: NDArray[np.bool_]) -> None:
    if late.any():
        longest = f"more than {LONGEST_APPROACH_S:g} s"
        reason = f"at this speed the target might take {longest}: expected a faster one"
        raise Refused(EXECUTION, reason)
