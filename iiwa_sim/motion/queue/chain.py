"""A chain: moves without a stop between, and where the robot is on them at which time.

The place x on its course is a cubic B-spline over theta, which counts cells of nominal time, and the clock
b(theta) = (dtheta/dt)^2 says how theta goes with time. The nominal motion is the moving average of the
fastest run without jerk limits; the clock then keeps all limits. A chain does not change: another one is
planned, with the same motion up to a front.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.courses import State
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.profile_kernel import UNIT_S
from iiwa_sim.motion.queue.course import Course
from iiwa_sim.motion.queue.motion_kernel import Motion, add_times
from iiwa_sim.motion.queue.move import Move

KEPT_S = 0.01
"""How much of the past a front keeps: an override looks back a little."""
BESIDE_BRAKING_S = 0.1
"""Until so long before it begins to brake at its end, a chain moves as one would that goes on."""
AHEAD_CELLS = 2


class Front(NamedTuple):
    """The part of a chain that stays when it is planned on. Arrays begin some cells before what can still
    be changed."""

    controls: Array
    """Coefficients (k + 3,) of x as a cubic B-spline over the cells."""
    clock: Array
    """Coefficients (k + 2,) of the clock as a quadratic B-spline over the cells."""
    times: Array
    """When the knots are passed (k + 1,), in s."""
    frozen: int
    """How many cells the clock is kept for; x is kept for all."""
    cells_s: Array
    """How long (s) the two cells behind the kept ones take in the chain that is planned on."""

    @classmethod
    def at_start(cls) -> "Front":
        """The front of a chain that begins from rest: nothing is kept."""
        return cls(np.zeros(3), np.zeros(2), np.zeros(1), 0, np.empty(0))

    @property
    def kept(self) -> int:
        """How many cells behind the frozen ones keep their x."""
        return len(self.times) - 1 - self.frozen

    @property
    def first_x(self) -> float:
        """x at which the first cell begins."""
        c = self.controls
        return float(c[0] + 4.0 * c[1] + c[2]) / 6.0

    @property
    def state(self) -> tuple[float, float, float]:
        """x, dx/dt (1/s) and d2x/dt2 (1/s^2) at the last knot."""
        c0, c1, c2 = self.controls[-3:].tolist()
        b0, b1 = (self.clock[-2:] / UNIT_S**2).tolist()
        b, slope = 0.5 * (b0 + b1), b1 - b0
        first, second = 0.5 * (c2 - c0), c0 - 2.0 * c1 + c2
        return (c0 + 4.0 * c1 + c2) / 6.0, first * b**0.5, second * b + 0.5 * first * slope


class Chain:
    """Joint positions (rad) over time: it sets out at time 0, and rests at the target of its last move at
    `rest_s`."""

    def __init__(
        self,
        course: Course,
        controls: Array,
        clock: Array,
        times: Array,
        rough: bool = False,
    ) -> None:
        """`times` (k + 1,) are those of the first knots."""
        self.course = course
        self.controls = controls
        self.clock = clock
        self.rough = rough
        """Whether it was planned quickly, and may be made faster."""
        k = len(times) - 1
        later = np.empty(len(clock) - 1 - k)
        later[0] = times[k] / UNIT_S
        add_times(clock[k:], later)
        self.times = np.concatenate([times[:k], later * UNIT_S])
        self.rest_s = float(self.times[-1])
        self._motion = Motion(course.way, controls, clock, self.times, UNIT_S)
        self.front_s = float(times[-1])
        """Up to this time (s) its motion is that of the chain it was planned from."""

    @property
    def moves(self) -> Sequence[Move]:
        return self.course.moves

    @property
    def end_s(self) -> float:
        """When it rests (s)."""
        return self.rest_s

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at its end."""
        return self.course.moves[-1].path.end

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad) at a time."""
        if time_s >= self.rest_s:
            return self.end
        if time_s <= 0.0:
            return self.course.moves[0].path.start
        return tuple(self.joints_along(np.array([time_s]))[0].tolist())

    def joints_along(self, times: Array) -> Array:
        """Joint positions (m, n), in rad, at times (m,), in s, before `rest_s`."""
        found = np.empty((len(times), self.course.joint_count))
        self._motion.joints_along(times, found)
        return found

    def along(self, times: Array) -> tuple[Array, Array]:
        """Joint positions with velocities, accelerations and jerks over planned time (m, 4, n) at times (m,),
        and the limits that hold there (m, 3, n). Before and behind it the robot rests."""
        found = np.empty((len(times), 4, self.course.joint_count))
        limits = np.empty((len(times), 3, self.course.joint_count))
        self._motion.along(times, found, limits)
        return found, limits

    def state(self, time_s: float) -> State:
        """Joint positions, velocities and accelerations at a time."""
        q, velocity, acceleration, _ = self.along(np.array([time_s]))[0][0].tolist()
        return tuple(q), tuple(velocity), tuple(acceleration)

    def x(self, time_s: float) -> float:
        """The place on its course at a time (s)."""
        return float(self._motion.x(time_s))

    def move_at(self, time_s: float) -> Move:
        """The move that is under way at a time (s). In a corner that is the second of two moves from the x of
        the target on."""
        return self.course.moves[self._index_at(time_s)]

    def _index_at(self, time_s: float) -> int:
        if time_s >= self.rest_s:
            return len(self.course.moves) - 1
        k: int = self._motion.move_at(time_s)
        return k

    def waiting(self, time_s: float) -> int:
        """How many of its moves have not begun at a time (s)."""
        return len(self.course.moves) - 1 - self._index_at(time_s)

    def front(self, now_s: float, time_s: float, free_s: float, until_x: float) -> Front:
        """What to keep of the chain when it is planned on at `now_s`.

        The clock is kept up to the first knot behind `time_s`, or up to `free_s` before the chain brakes at
        its end if that is later. x is kept longer: up to a little before the chain brakes, or before the run
        whose mean it is comes to `until_x`.
        """
        c, times = self.controls, self.times
        speeds = 0.5 * (c[2:] - c[:-2]) * np.sqrt(0.5 * (self.clock[:-1] + self.clock[1:])) / UNIT_S
        rising = (speeds[1:] > speeds[:-1]).nonzero()[0]
        brakes_s = float(times[rising[-1] + 1]) if len(rising) else 0.0
        most = len(times) - 2
        k = max(min(int(times.searchsorted(max(time_s, brakes_s - free_s))), most), 1)
        first = max(min(int(times.searchsorted(now_s - KEPT_S)) - 1, k - 1), 0)
        until_s = max(brakes_s - BESIDE_BRAKING_S, 0.5 * (brakes_s + times[k]))
        last = min(int(times.searchsorted(until_s)), most)
        ahead = (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0 + 0.5 * self.course.window_s * speeds
        last = max(min(last, int(ahead[: last + AHEAD_CELLS].searchsorted(until_x)) - AHEAD_CELLS), k)
        return Front(
            self.controls[first : last + 3],
            self.clock[first : last + 2],
            self.times[first : last + 1],
            k - first,
            np.diff(self.times[last : last + 3]),
        )


class Ahead(NamedTuple):
    """A chain in place of the one under way."""

    chain: Chain
    moves: int
    """How many of the moves that waited are part of it."""
