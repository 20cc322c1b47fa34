"""Impedance: a nominal motion that goes to the newest move, and a robot that yields around it."""

from collections.abc import Callable

from iiwa_sim.motion.braking import Braking
from iiwa_sim.motion.compliance_kernel import Compliance, Manner
from iiwa_sim.motion.joint_bounds_kernel import largest_way
from iiwa_sim.motion.joint_springs_kernel import JointSprings
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.nominal import Nominal
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.wrench import TcpContact

STILL_RAD_PER_S = 2e-4
"""A robot off its plan is at rest when no joint has been faster than this ..."""
STILL_S = 0.05
"""... for so long: longer than a swing takes to turn round."""
HARDLY_MOVING_RAD_PER_S = 1e-9
"""A robot slower than this need not brake."""
STIFFLESS = Manner(0.0, (0.0,) * 6)
"""Before the first move: never felt, as yielding begins with one."""


class Impedance:
    """Joint positions (rad) over ticks.

    There is no queue: a move replaces the one before, in mid-motion (`Nominal`). The robot yields around the
    nominal motion, in the manner of the newest move that has begun, until it is stopped. A gravity hold
    cancels the move that runs, and begins where the robot is when the nominal motion has come to rest. A stop
    ends it, a move, or another hold.

    A stop ends the yielding at once. A robot that is on its plan stops on its path, as in any move; one that
    is off it brakes from the velocity it has. So where it comes to rest is known beforehand, and it stays
    there.
    """

    def __init__(
        self,
        joints: Joints,
        tick_s: float,
        nominal: Callable[[Joints], Nominal],
        compliance: Compliance,
        springs: JointSprings,
        braking: Braking,
    ) -> None:
        """At rest, and stiff, at `joints` (rad). `nominal` makes a nominal motion that rests there."""
        self.joints = joints
        self.tcp_contact: TcpContact | None = None
        """Where the TCP has come to in the last tick, and what it touches there, where that is known."""
        self._tick_s = tick_s
        self._new_nominal = nominal
        self._compliance = compliance
        self._springs = springs
        self._braking = braking
        self._before = joints  # in the tick before
        self._still_ticks = 0
        self._ending: Nominal | None = None  # the nominal motion before, while it is being stopped
        self._nominal = nominal(joints)
        self._yielding = False  # rather than stiff: braking, or at rest
        self._newest = 0  # the number of the newest move or hold, if that is not over
        self._manner = STIFFLESS
        self._next_manner: Manner | None = None  # of a move that has not begun
        self._hold: float | None = None  # its stiffness
        self._hold_has_begun = False

    @property
    def rest(self) -> Joints:
        """Where a move that comes now begins (rad): on the nominal motion; in a hold, where the robot is."""
        return self.joints if self._hold_has_begun else self._nominal.begins

    @property
    def goal(self) -> Joints:
        """Where the move under way, or a stop, or a hold, would rest without forces (rad)."""
        if self._stopping:
            return self.rest_after_stop()
        return self._springs.centre if self._hold_has_begun else self._nominal.goal

    @property
    def moving(self) -> bool:
        """Whether the robot moves, brakes or holds, or a move waits."""
        # Asked for in every tick: the likeliest first.
        if self._hold is not None or self._nominal.moving or self._stopping:
            return True
        return self._yielding and not self._at_rest

    @property
    def yielding(self) -> bool:
        """Whether the robot gives way to forces, and is not stiff: also at rest, until it is stopped."""
        return self._yielding

    @property
    def holding(self) -> bool:
        """Whether a gravity hold is on, or begins when the robot is at rest."""
        return self._hold is not None

    @property
    def waiting(self) -> int:
        """Moves and holds that have not begun: 0 or 1."""
        return int(self._nominal.waits if self._hold is None else not self._hold_has_begun)

    @property
    def behind(self) -> int:
        """Moves and holds that have not begun, without one that begins in the next tick: 0 or 1."""
        return self.waiting if self._stopping or self._nominal.stopping else 0

    def is_pending(self, number: int) -> bool:
        """Whether a move or a hold of this number is under way or waits."""
        return number == self._newest and (self._hold is not None or self._nominal.moving)

    def head_for(self, move: Move, manner: Manner) -> None:
        """Carry out a move that begins at `rest` in place of what runs or waits."""
        if self._hold_has_begun:
            self._nominal = self._new_nominal(self.joints)
            self._compliance.start(self.joints, self._velocity)
        self._hold, self._hold_has_begun = None, False
        self._nominal.head_for(move)
        self._newest, self._next_manner = move.number, manner

    def hold(self, number: int, stiffness_nm_per_rad: float) -> None:
        """Hold the joints by springs, when what runs has come to rest on its path."""
        if self._hold_has_begun:
            self._springs.start(self.joints, self._velocity, stiffness_nm_per_rad)
        elif self._nominal.moving:
            self._nominal.stop()
        self._newest, self._hold = number, stiffness_nm_per_rad

    def cancel(self) -> None:
        """End the nominal move that runs, or begins in the next tick: stop on its path. The robot yields on.

        While it is being stopped, and in a hold, nothing changes.
        """
        if not self._stopping and not self.holding and not self._nominal.stopping:
            self._nominal.stop()
            self._newest = 0

    def clear(self) -> None:
        """Forget a move, or a hold, that waits until the robot has come to rest."""
        if self._stopping:
            self._forget(self.rest_after_stop())
        elif self._nominal.stopping:
            self._nominal.stop()
            self._hold, self._newest = None, 0

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        if self._ending is not None:
            return self._ending.rest_after_stop()
        if self._on_plan:
            return self._nominal.rest_after_stop()
        if self._braking.active or self._fast:
            return self._braking.rest(self.joints, self._velocity)
        return self.joints

    def stop(self) -> None:
        """Yield no longer, and brake; forget what waits."""
        rest = self.rest_after_stop()
        if self._on_plan:
            self._nominal.stop()
            self._ending = self._nominal if self._nominal.moving else None
        elif self._fast and not self._stopping:
            self._braking.start(self.joints, self._velocity)
        if not self._stopping:
            # The plan may have come to rest within the last tick, which leaves a velocity that has ended.
            self._before = self.joints
        self._forget(rest)

    def start_from(self, joints: Joints) -> None:
        """Be at rest, and stiff, elsewhere (rad): something else has moved the robot, or will have."""
        self.joints = self._before = joints
        self._forget(joints)

    def step(self) -> None:
        """One tick. Where the nominal motion fails, the robot stops, and what it raised is raised."""
        self.tcp_contact = None
        if self._stopping:
            self._stop_on()
            return
        if not self._yielding:
            if not (self._nominal.moving or self.holding):
                return
            self._yielding = True
            self._compliance.start(self.joints)
        try:
            self._go_to(self._next())
        except Exception:
            self.stop()
            raise

    @property
    def _stopping(self) -> bool:
        return self._ending is not None or self._braking.active

    @property
    def _on_plan(self) -> bool:
        """Whether the robot yields, and is exactly where the nominal motion is, or has ended."""
        return self._yielding and not self._hold_has_begun and self._compliance.on_plan

    def _stop_on(self) -> None:
        """A tick of a stop."""
        if self._ending is None:
            self._go_to(self._braking.step())
        else:
            self._ending.step()
            self._go_to(self._ending.joints)
            if not self._ending.moving:
                self._ending = None
        if not self._stopping:
            self._before = self.joints

    def _next(self) -> Joints:
        """Where the robot yields to in this tick."""
        if self._hold is not None and not self._nominal.moving:
            if not self._hold_has_begun:
                self._springs.start(self.joints, self._velocity, self._hold)
                self._hold_has_begun = True
            return self._springs.step()
        self._nominal.step()
        if self._next_manner is not None and not self._nominal.waits:
            self._manner, self._next_manner = self._next_manner, None
        joints = self._compliance.step(self._nominal.joints, self._manner)
        self.tcp_contact = self._compliance.tcp_contact
        return joints

    def _go_to(self, joints: Joints) -> None:
        self._before, self.joints = self.joints, joints
        if largest_way(self._before, joints) <= STILL_RAD_PER_S * self._tick_s:
            self._still_ticks += 1
        else:
            self._still_ticks = 0

    @property
    def _velocity(self) -> list[float]:
        """In the last tick (rad/s)."""
        return [(a - b) / self._tick_s for a, b in zip(self.joints, self._before, strict=True)]

    @property
    def _fast(self) -> bool:
        return max(map(abs, self._velocity)) > HARDLY_MOVING_RAD_PER_S

    @property
    def _at_rest(self) -> bool:
        return self._compliance.on_plan or self._still_ticks * self._tick_s >= STILL_S

    def _forget(self, rest: Joints) -> None:
        """Stiff, with nothing that waits, and the next move to begin at `rest` (rad)."""
        self._nominal = self._new_nominal(rest)
        self._yielding = False
        self._newest = 0
        self._manner, self._next_manner = STIFFLESS, None
        self._hold, self._hold_has_begun = None, False
