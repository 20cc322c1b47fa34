"""Braking of joints from any velocity to rest, each as fast as the limits of a stop allow."""

from collections.abc import Sequence

from ruckig import ControlInterface, InputParameter, Result, Ruckig, Synchronization, Trajectory

from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.joints import Joints


class Braking:
    """Joint positions (rad) over ticks, from a velocity to rest.

    Acceleration is 0 at the beginning and at the end, so the joints brake from constant speed. Joints that
    keep `JointBounds` come to rest within their position limits.
    """

    def __init__(
        self,
        bounds: JointBounds,
        tick_s: float,
        stop_acceleration: Sequence[float],
        stop_jerk: Sequence[float],
    ) -> None:
        self._bounds = bounds
        self._tick_s = tick_s
        joints = len(stop_acceleration)
        task = InputParameter(joints)
        task.control_interface = ControlInterface.Velocity
        task.synchronization = Synchronization.No
        task.current_acceleration = task.target_velocity = task.target_acceleration = [0.0] * joints
        task.max_acceleration, task.max_jerk = list(stop_acceleration), list(stop_jerk)
        self._task = task
        self._ruckig = Ruckig(joints)
        self._trajectory: Trajectory | None = None
        self._time_s = 0.0

    @property
    def active(self) -> bool:
        """Whether joints are braking."""
        return self._trajectory is not None

    def rest(self, joints: Joints, velocity: Sequence[float]) -> Joints:
        """Joint positions (rad) at rest, after braking from a velocity (rad/s), or at the end of braking
        in progress."""
        trajectory = self._trajectory or self._plan(joints, velocity)
        return self._bounds.within(tuple(trajectory.at_time(trajectory.duration)[0]))

    def start(self, joints: Joints, velocity: Sequence[float]) -> None:
        """Brake from joint positions (rad) and a velocity (rad/s)."""
        self._trajectory, self._time_s = self._plan(joints, velocity), 0.0

    def step(self) -> Joints:
        """Joint positions after a tick."""
        trajectory = self._trajectory
        assert trajectory is not None
        self._time_s += self._tick_s
        time_s = min(self._time_s, trajectory.duration)
        if time_s == trajectory.duration:
            self._trajectory = None
        return self._bounds.within(tuple(trajectory.at_time(time_s)[0]))

    def _plan(self, joints: Joints, velocity: Sequence[float]) -> Trajectory:
        self._task.current_position, self._task.current_velocity = list(joints), list(velocity)
        trajectory = Trajectory(len(joints))
        result = self._ruckig.calculate(self._task, trajectory)
        if result != Result.Working:
            raise ArithmeticError(f"Ruckig: {result} for braking from {velocity} rad/s")
        return trajectory
