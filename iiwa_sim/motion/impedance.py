"""Impedance of one robot around its nominal motion or in a hold, and braking after it."""

from collections.abc import Callable
from operator import sub

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, Synchronization, Trajectory

from iiwa_sim.contact.tcp_contact_kernel import TcpContact, TcpState
from iiwa_sim.motion.impedance_kernel import JointBounds, JointSprings, TcpSprings
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.ruckig_trajectory import RuckigTrajectory
from iiwa_sim.motion.springs import CartesianImpedance
from iiwa_sim.robot.arm_kernel import Kinematics
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.wrench import Wrench

STIFF, COMPLIANT_TCP, COMPLIANT_JOINTS = 0, 1, 2
"""Compliance of a robot: none, as a mass at the TCP, or in each joint."""
STILL_RAD_PER_S = 2e-4
"""A robot off its plan is at rest when no joint has been faster than this ..."""
STILL_S = 0.05
"""... for so long: longer than a swing takes to turn round."""
HARDLY_MOVING_RAD_PER_S = 1e-9
"""A robot slower than this need not brake."""
NO_SPRINGS = CartesianImpedance(0.0, (0.0,) * 6)
"""Impedance before the first move, whose own replaces it when that begins."""


Pushes = Callable[[], tuple[Wrench, tuple[float, ...]]]
"""Returns the push at the TCP, along its axes, and torques (Nm) on the joints, besides surfaces there."""


class Impedance:
    """Joint positions (rad) over ticks, while the robot is compliant, or brakes because it was.

    In a stiffness move the TCP is compliant around the nominal motion. In a hold every joint is compliant
    around the place where the hold began. Before a start, and at rest after a stop, the robot is stiff and
    follows the nominal motion exactly.
    """

    def __init__(
        self,
        joints: Joints,
        tick_s: float,
        description: RobotDescription,
        kinematics: Kinematics,
        pushes: Pushes,
        contact: TcpContact | None,
    ) -> None:
        """Stiff, at joint positions (rad); `contact` is that of the TCP, None where there are no surfaces."""
        self.joints = joints
        """Joint positions of the robot (rad), while this is active."""
        self.active = False
        """True if the robot is compliant or brakes, so that it may be beside the nominal motion."""
        self.compliant = False
        """True if forces deflect the robot."""
        self.holding = False
        """True if the robot is compliant around the start of a hold, not around the nominal motion."""
        self.impedance = NO_SPRINGS
        """Impedance of the TCP around the nominal motion."""
        self.tcp_contact: TcpState | None = None
        """TCP after the last tick and its contact there; None if that is not known."""
        self.braking: RuckigTrajectory | None = None
        """Trajectory on which a compliant robot brakes from its velocity; None while it does not."""
        d = description
        bounds = JointBounds(
            tick_s, d.position_min, d.position_max, d.velocity, d.stop_acceleration, d.stop_jerk
        )
        self._bounds = bounds
        self._tcp_springs = TcpSprings(kinematics, bounds, tick_s, pushes, contact)
        self._joint_springs = JointSprings(kinematics, bounds, tick_s, pushes, contact)
        self._tick_s, self._still_rad = tick_s, STILL_RAD_PER_S * tick_s
        self._before = joints  # in the tick before
        self._still_ticks = 0
        self._braking_s = 0.0
        task = InputParameter(len(joints))
        task.control_interface = ControlInterface.Velocity
        task.synchronization = Synchronization.No
        task.current_acceleration = task.target_velocity = task.target_acceleration = [0.0] * len(joints)
        task.max_acceleration, task.max_jerk = list(d.stop_acceleration), list(d.stop_jerk)
        self._task = task

    @property
    def off_plan(self) -> bool:
        """True if the robot is compliant, and not exactly where the nominal motion is."""
        return self.compliant and (self.holding or not self._tcp_springs.on_plan)

    @property
    def moving(self) -> bool:
        """True if the robot brakes, is held, or has not come to rest beside the nominal motion."""
        if self.holding or self.braking is not None:
            return True
        return self.off_plan and self._still_ticks * self._tick_s < STILL_S

    @property
    def centre(self) -> Joints:
        """Joints at which a hold keeps the robot (rad)."""
        centre: Joints = self._joint_springs.centre
        return centre

    def start(self, joints: Joints) -> None:
        """Be compliant from now on: nominal motion and robot rest at joint positions (rad)."""
        self.joints = self._before = joints
        self.active = self.compliant = True
        self._still_ticks = 0
        self._tcp_springs.start(joints)

    def hold(self, stiffness_nm_per_rad: float) -> None:
        """Hold every joint by a spring where it is."""
        self._joint_springs.start(self.joints, self._velocity, stiffness_nm_per_rad)
        self.holding = True

    def let_go(self) -> None:
        """End a hold: be compliant around a nominal motion that rests where the robot is."""
        self._tcp_springs.start(self.joints, self._velocity)
        self.holding = False

    def rest_after_stop(self) -> Joints:
        """Place of rest after a stop now of a robot off the nominal motion (rad)."""
        if self.braking is not None:
            return self.braking.end
        return self._trajectory_to_rest().end if self._is_fast else self.joints

    def stop(self) -> None:
        """Be stiff again. On the nominal motion the robot is where that is; off it, it brakes."""
        if self.off_plan and self._is_fast:
            self.braking, self._braking_s = self._trajectory_to_rest(), 0.0
        self.active, self.compliant, self.holding = self.braking is not None, False, False
        self.impedance, self.tcp_contact = NO_SPRINGS, None

    def step(self, nominal: Joints) -> None:
        """Make a tick, after which the nominal motion is at joint positions (rad)."""
        before, self.tcp_contact = self.joints, None
        if self.braking is not None:
            self._braking_s += self._tick_s
            joints = self._bounds.within(self.braking.joints(self._braking_s))
            if self._braking_s >= self.braking.end_s:
                self.braking, self.active = None, False
        elif self.holding:
            joints = self._joint_springs.step()
        else:
            joints = self._tcp_springs.step(nominal, self.impedance)
            self.tcp_contact = self._tcp_springs.tcp_contact
        self._before, self.joints = before, joints
        # In most ticks the first joint shows that the robot moves.
        most = self._still_rad
        if abs(joints[0] - before[0]) > most or max(map(abs, map(sub, joints, before))) > most:
            self._still_ticks = 0
        else:
            self._still_ticks += 1

    def _trajectory_to_rest(self) -> RuckigTrajectory:
        """Brake from constant speed, each joint as fast as the limits of a stop allow."""
        self._task.current_position, self._task.current_velocity = list(self.joints), self._velocity
        found = Trajectory(len(self.joints))
        result = Ruckig(len(self.joints)).calculate(self._task, found)
        if result != Result.Working:
            raise ArithmeticError(f"Ruckig: {result} for braking from {self._velocity} rad/s")
        return RuckigTrajectory(found, self._bounds.within(tuple(found.at_time(found.duration)[0])))

    @property
    def _velocity(self) -> list[float]:
        """Velocities of the joints in the last tick (rad/s)."""
        velocity: list[float] = (np.subtract(self.joints, self._before) / self._tick_s).tolist()
        return velocity

    @property
    def _is_fast(self) -> bool:
        return max(map(abs, self._velocity)) > HARDLY_MOVING_RAD_PER_S
