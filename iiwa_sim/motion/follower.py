"""The follower: how the robot gives way to forces, around the nominal motion or where it is held."""

from iiwa_sim.motion.braking import Braking
from iiwa_sim.motion.compliance_kernel import CartesianImpedance, Compliance
from iiwa_sim.motion.joint_bounds_kernel import largest_way
from iiwa_sim.motion.joint_springs_kernel import JointSprings
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.feeling_kernel import Reached

STILL_RAD_PER_S = 2e-4
"""A robot off its plan is at rest when no joint has been faster than this ..."""
STILL_S = 0.05
"""... for so long: longer than a swing takes to turn round."""
HARDLY_MOVING_RAD_PER_S = 1e-9
"""A robot slower than this need not brake."""
NO_SPRINGS = CartesianImpedance(0.0, (0.0,) * 6)
"""Impedance before the first move, whose own replaces it when that begins."""


class Follower:
    """Joint positions (rad) over ticks, while the robot yields, or brakes because it did.

    It yields at the TCP around the nominal motion, as a stiffness move has asked for, or in every joint
    around where a hold has begun. Until it is started, and when it has been stopped and is at rest, the robot
    is stiff: it is where the nominal motion is, and this has nothing to do.
    """

    def __init__(
        self, joints: Joints, tick_s: float, compliance: Compliance, springs: JointSprings, braking: Braking
    ) -> None:
        """Stiff, at joint positions (rad)."""
        self.joints = joints
        """Where the robot has come to (rad), while this is active."""
        self.active = False
        """Whether the robot yields or brakes, and is not where the nominal motion is but elsewhere."""
        self.yielding = False
        """Whether the robot gives way to forces."""
        self.holding = False
        """Whether it does so around where a hold has begun, and not around the nominal motion."""
        self.impedance = NO_SPRINGS
        """How the TCP gives way around the nominal motion."""
        self.tcp_contact: Reached | None = None
        """Where the last tick has brought the TCP, and what it touches there; None if that is not known."""
        self._tick_s = tick_s
        self._compliance = compliance
        self._springs = springs
        self._braking = braking
        self._before = joints  # in the tick before
        self._still_ticks = 0

    @property
    def braking(self) -> bool:
        """Whether the robot brakes from the velocity it had while it yielded."""
        return self._braking.active

    @property
    def off_plan(self) -> bool:
        """Whether the robot yields, and is not exactly where the nominal motion is."""
        return self.yielding and (self.holding or not self._compliance.on_plan)

    @property
    def moving(self) -> bool:
        """Whether the robot brakes, is held, or has not come to rest beside the nominal motion."""
        if self.holding or self.braking:
            return True
        return self.yielding and not (self._compliance.on_plan or self._still_ticks * self._tick_s >= STILL_S)

    @property
    def centre(self) -> Joints:
        """Where the robot is held (rad)."""
        centre: Joints = self._springs.centre
        return centre

    def start(self, joints: Joints) -> None:
        """Yield from now on: a nominal motion rests at joint positions (rad), and so does the robot."""
        self.joints = self._before = joints
        self.active = self.yielding = True
        self._still_ticks = 0
        self._compliance.start(joints)

    def hold(self, stiffness_nm_per_rad: float) -> None:
        """Hold every joint by a spring where it is."""
        self._springs.start(self.joints, self._velocity, stiffness_nm_per_rad)
        self.holding = True

    def let_go(self) -> None:
        """End a hold: yield around a nominal motion that rests where the robot is."""
        self._compliance.start(self.joints, self._velocity)
        self.holding = False

    def rest_after_stop(self) -> Joints:
        """Where a robot that is off the nominal motion would come to rest if it were stopped now (rad)."""
        return self._braking.rest(self.joints, self._velocity) if self._fast else self.joints

    def stop(self) -> None:
        """Yield no longer. On the nominal motion the robot is where that is; off it, it brakes."""
        if self.off_plan and self._fast:
            self._braking.start(self.joints, self._velocity)
        self.active, self.yielding, self.holding = self.braking, False, False
        self.impedance, self.tcp_contact = NO_SPRINGS, None

    def step(self, nominal: Joints) -> None:
        """A tick in which the robot yields, and the nominal motion has come to joint positions (rad)."""
        if self.holding:
            self._go_to(self._springs.step())
            self.tcp_contact = None
        else:
            self._go_to(self._compliance.step(nominal, self.impedance))
            self.tcp_contact = self._compliance.tcp_contact

    def brake(self) -> None:
        """A tick in which the robot brakes."""
        self._go_to(self._braking.step())
        self.active = self.braking

    def _go_to(self, joints: Joints) -> None:
        self._before, self.joints = self.joints, joints
        if largest_way(self._before, joints) <= STILL_RAD_PER_S * self._tick_s:
            self._still_ticks += 1
        else:
            self._still_ticks = 0

    @property
    def _velocity(self) -> list[float]:
        """Velocities of the joints in the last tick (rad/s)."""
        return [(a - b) / self._tick_s for a, b in zip(self.joints, self._before, strict=True)]

    @property
    def _fast(self) -> bool:
        return max(map(abs, self._velocity)) > HARDLY_MOVING_RAD_PER_S
