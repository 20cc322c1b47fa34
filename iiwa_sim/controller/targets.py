"""Targets of servos: joint positions and limits of a smart or direct move, or why there are none."""

import numpy as np

from iiwa_sim.controller.errors import EXECUTION, TARGET_NOT_REACHABLE, Refused
from iiwa_sim.controller.lin_planner import ROUNDING_RAD
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.planner import Planner
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.wording import distinct

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
        """Return the joint positions (rad) that a servo heads for from the present ones, and its limits.

        For a frame in the base they are the nearest ones that bring the flange there.
        """
        if isinstance(request.target, Frame):
            target = self._planner.flange_target(present, request.target, request.speed)
            limits = self.limits[mode].at_speed(request.speed)
        else:
            target, speeds = self._planner.joint_target(present, request.target, request.speeds)
            limits = self.limits[mode].at_speed(speeds)
        distances: Array = np.abs(np.subtract(target, present))
        farthest = int(distances.argmax())
        if mode is Mode.DIRECT and distances[farthest] > DIRECT_REACH_RAD + ROUNDING_RAD:
            name = self._names[farthest]
            distance, reach = distinct(float(distances[farthest]), DIRECT_REACH_RAD)
            raise Refused(
                TARGET_NOT_REACHABLE,
                f"{name} is {distance} rad from the target: a direct move goes {reach} rad "
                "at most, a smart move anywhere",
            )
        if moving:
            distances = distances + self._way_of_braking(mode)
        self._check_approach(limits, distances)
        return target, limits

    def check_way_back(self, limits: JointLimits) -> None:
        """Raises `Refused` where a robot in motion that passes its path might take too long to come back."""
        self._check_approach(limits, self._way_of_braking(Mode.SMART))

    def _way_of_braking(self, mode: Mode) -> Array:
        """Return how far joints may go that have to brake first, and then come back (rad)."""
        velocity, acceleration, jerk = self.limits[mode]
        way: Array = velocity * (velocity / acceleration + 2.0 * acceleration / jerk)
        return way

    @staticmethod
    def _check_approach(limits: JointLimits, distances: Array) -> None:
        if (distances > limits.velocity * LONGEST_APPROACH_S).any():
            longest = f"more than {LONGEST_APPROACH_S:g} s"
            reason = f"at this speed the target might take {longest}: expected a faster one"
            raise Refused(EXECUTION, reason)
