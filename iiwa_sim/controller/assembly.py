"""The motions of one robot, put together."""

import numpy as np

from iiwa_sim.controller.motions import Motions
from iiwa_sim.frames import Transform
from iiwa_sim.motion.braking import Braking
from iiwa_sim.motion.compliance_kernel import Compliance
from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.follower import Follower
from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.joint_springs_kernel import JointSprings
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.servo import Servo
from iiwa_sim.motion.surroundings import Pushes
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.robot.arm_kernel import Kinematics
from iiwa_sim.robot.feeling_kernel import Feeling
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model


def motions_of(
    model: Model,
    tool_in_flange: Transform,
    start: Joints,
    tick_s: float,
    limits: JointLimits,
    pushes: Pushes,
    feeling: Feeling | None,
) -> Motions:
    """The motions of a robot at rest at `start` (rad); `limits` are those of smart mode at full speed.

    A robot that is not stiff yields to `pushes` and to what it feels, None where there is nothing to touch.
    """
    description = model.description
    low, high = description.position_min, description.position_max
    stop = description.stop_acceleration, description.stop_jerk
    time = TimeScaling(tick_s, description.stop_rate_per_s, description.stop_rate_change_per_s2)
    bounds = JointBounds(tick_s, low, high, description.velocity, *stop)
    kinematics = Kinematics(model, Inverse(model), tool_in_flange)
    follower = Follower(
        start,
        tick_s,
        Compliance(kinematics, bounds, tick_s, pushes, feeling),
        JointSprings(kinematics, bounds, tick_s, pushes, feeling),
        Braking(bounds, tick_s, *stop),
    )
    executor = Executor(start, time, np.array(low), np.array(high))
    return Motions(executor, Servo(executor, limits, low, high), follower)
