"""Impedance: moves that are planned and run like any others, and a robot that yields around them."""

from collections import deque
from collections.abc import Callable

from iiwa_sim.motion.braking import Braking
from iiwa_sim.motion.compliance import Compliance, Manner
from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.joint_springs import JointSprings
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.sampled_path import Joints
from iiwa_sim.motion.surroundings import Felt

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

    Moves queue in a drive of its own, which gives the nominal motion; the robot yields around it, in the
    manner of the move under way, or of the last one, until it is stopped. A gravity hold begins where the
    robot is when the moves before it are done, and ends with a stop only: what comes behind it waits, and
    never begins.

    A stop ends the yielding at once. A robot that is on its plan stops on its path, as in any move; one that
    is off it brakes from the velocity it has. So where it comes to rest is known beforehand, and it stays
    there.
    """

    def __init__(
        self,
        joints: Joints,
        tick_s: float,
        nominal: Callable[[Joints], Drive],
        compliance: Compliance,
        springs: JointSprings,
        braking: Braking,
    ) -> None:
        """At rest, and stiff, at `joints` (rad). `nominal` makes a drive that rests at joint positions."""
        self.joints = joints
        self.felt: Felt | None = None
        """Where the TCP has come to in the last tick, and what it touches there, where that is known."""
        self._tick_s = tick_s
        self._new_nominal = nominal
        self._compliance = compliance
        self._springs = springs
        self._braking = braking
        self._before = joints  # in the tick before
        self._still_ticks = 0
        self._nominal = nominal(joints)
        self._ending: Drive | None = None  # the nominal motion before, while it is being stopped on its path
        self._yielding = False  # rather than stiff: braking, or at rest
        self._manners: deque[tuple[int, Manner]] = deque()  # of moves that have not begun, by number
        self._manner = STIFFLESS
        self._hold: float | None = None  # its stiffness
        self._hold_number = 0
        self._hold_has_begun = False
        self._behind: list[int] = []  # moves behind the hold, by their numbers

    @property
    def rest(self) -> Joints:
        """Where the next move begins (rad): where the nominal motion ends."""
        return self._nominal.rest

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
    def holding(self) -> bool:
        """Whether a gravity hold is on or waits for its turn."""
        return self._hold is not None

    @property
    def waiting(self) -> int:
        """Moves and holds that have not begun."""
        hold_waits = self._hold is not None and not self._hold_has_begun
        return self._nominal.waiting + hold_waits + len(self._behind)

    @property
    def behind(self) -> int:
        """Moves and holds behind what runs, or begins in the next tick; all that wait during a stop."""
        if self._stopping or self._hold_has_begun or not self.waiting:
            return self.waiting
        hold_waits = self._hold is not None
        if self._nominal.moving:
            return self._nominal.behind + hold_waits + len(self._behind)
        return len(self._behind)

    @property
    def hold_runs(self) -> bool:
        """Whether a hold is on, or is what begins next."""
        return self.holding and not self._nominal.moving

    def is_pending(self, number: int) -> bool:
        """Whether a move or a hold of this number is under way or waits."""
        return number in self._behind or number == self._hold_number or self._nominal.is_pending(number)

    def append(self, move: Move, manner: Manner) -> None:
        """Queue a move that begins at `rest`, or behind a hold."""
        if self.holding:
            self._behind.append(move.number)
            return
        self._nominal.append(move)
        self._manners.append((move.number, manner))

    def wait_behind_hold(self, number: int) -> None:
        """A move of any kind that comes during a hold."""
        self._behind.append(number)

    def hold(self, number: int, stiffness_nm_per_rad: float) -> None:
        """Hold the joints by springs when the moves that wait are done, or wait behind another hold."""
        if self.holding:
            self._behind.append(number)
        else:
            self._hold_number, self._hold = number, stiffness_nm_per_rad

    def cancel(self) -> None:
        """End the nominal move that runs, or begins in the next tick, as `Drive.cancel` does.

        The robot yields on. While it is being stopped, and in a hold, nothing changes.
        """
        if not self._stopping and not self.hold_runs:
            self._nominal.cancel()
            self._drop_manners()

    def clear(self) -> None:
        """Forget the moves, and a hold, behind what runs, or begins in the next tick."""
        if self._stopping:
            self._forget(self.rest_after_stop())
            return
        if not self.hold_runs:
            self._nominal.clear()
            self._nominal.forget([self._hold_number, *self._behind])
            self._drop_manners()
            self._hold, self._hold_number = None, 0
        self._behind.clear()

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        if self._ending is not None:
            return self._ending.rest
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
        self.felt = None
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
        while self._manners and self._has_begun(self._manners[0][0]):
            number, manner = self._manners.popleft()
            if not self._nominal.has_forgotten(number):
                self._manner = manner
        joints = self._compliance.step(self._nominal.joints, self._manner)
        self.felt = self._compliance.felt
        return joints

    def _has_begun(self, number: int) -> bool:
        return number == self._nominal.under_way or not self._nominal.is_pending(number)

    def _drop_manners(self) -> None:
        """Of moves that will not begin any more."""
        pending = [each for each in self._manners if self._nominal.is_pending(each[0])]
        self._manners.clear()
        self._manners.extend(pending)

    def _go_to(self, joints: Joints) -> None:
        self._before, self.joints = self.joints, joints
        for after, before in zip(joints, self._before, strict=True):
            if not -STILL_RAD_PER_S <= (after - before) / self._tick_s <= STILL_RAD_PER_S:
                self._still_ticks = 0
                return
        self._still_ticks += 1

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
        self._manners.clear()
        self._manner = STIFFLESS
        self._hold = None
        self._hold_number = 0
        self._hold_has_begun = False
        self._behind.clear()
