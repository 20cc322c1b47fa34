"""Trajectories along blended paths: q(x(t)), where x(t) is a piecewise quintic.

A trajectory does not change: another one is planned, with the same motion up to a front. One move alone whose
joints go straight takes the fastest motion from rest to rest in closed form. Any other has a speed profile
over segments (`speed_profile.py`), whose x, dx/dt and d2x/dt2 at the knots the quintics interpolate.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.blend import Blend, Move
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.plan_kernel import UNIT_S, BlendedPath
from iiwa_sim.motion.ruckig_trajectory import State
from iiwa_sim.motion.speed_profile import (
    MANY_SEGMENTS,
    SEGMENT_S,
    Slices,
    T,
    blend_spans,
    fastest,
    guess,
    nominal,
    sampled,
    sets_out,
)

FREE_S = 0.4
"""A trajectory that is extended is planned anew from so long before it brakes at its end."""
KEPT_S = 0.01
"""Part of the past (s) that a front keeps: an override looks back a little."""
BESIDE_BRAKING_S = 0.1
"""Until so long before it begins to brake at its end, a trajectory moves like an extended one."""
AHEAD_SEGMENTS = 2
LATE = 0.95
"""Part of the rest of a blend that is used, if the robot is past the beginning of the whole one."""
LITTLE_KEPT_S = 0.1
"""Time in which x is kept if a trajectory is to end sooner."""
LEAST_BLEND = 0.1
"""If less than this part of a blend is left, it is too late for it."""
STILL = 1e-12
"""rad per unit of x: a joint that goes less bounds nothing."""


class Front(NamedTuple):
    """The part of a trajectory that stays when it is extended."""

    times: Array
    """When the knots of the quintics that stay are passed (m + 1,), in s."""
    quintics: Array
    """Their coefficients over the part of each that is done (6, m)."""
    controls: Array
    """Coefficients (kept + 3,) of x as a cubic B-spline over the segments behind these that keep their x."""
    profile: Array
    """Coefficients (kept + 2,) of the speed profile over these segments; two of them stay."""
    lengths_s: Array
    """Lengths (s) of the two segments behind these in the trajectory that is extended."""

    @property
    def state(self) -> tuple[float, float, float]:
        """x, dx/dt (1/s) and d2x/dt2 (1/s^2) at the last knot of the B-spline."""
        c0, c1, c2 = self.controls[-3:].tolist()
        b0, b1 = (self.profile[-2:] / UNIT_S**2).tolist()
        b, slope = 0.5 * (b0 + b1), b1 - b0
        first, second = 0.5 * (c2 - c0), c0 - 2.0 * c1 + c2
        return (c0 + 4.0 * c1 + c2) / 6.0, first * sqrt(b), second * b + 0.5 * first * slope


_HERMITE = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        [-10.0, -6.0, -3.0, 10.0, -4.0, 1.0],
        [15.0, 8.0, 3.0, -15.0, 7.0, -2.0],
        [-6.0, -3.0, -1.0, 6.0, -3.0, 1.0],
    ]
)
"""Coefficients of the quintic over 0..1 from value, slope and half of the second derivative at both ends."""
_AT_HALVES = np.zeros((10, 7))
"""Factors of coefficients of x (4) and the squared rate b (3) in values at beginning and middle of a segment.
These are x, its slope, half of its second derivative, b and a quarter of its slope."""
_AT_HALVES[:6, :4] = np.array(
    [
        [8.0, 32.0, 8.0, 0.0],
        [1.0, 23.0, 23.0, 1.0],
        [-24.0, 0.0, 24.0, 0.0],
        [-6.0, -30.0, 30.0, 6.0],
        [24.0, -48.0, 24.0, 0.0],
        [12.0, -12.0, -12.0, 12.0],
    ]
) / 48.0  # fmt: skip
_AT_HALVES[6:, 4:] = np.array([[4.0, 4.0, 0.0], [1.0, 6.0, 1.0], [-2.0, 2.0, 0.0], [-1.0, 0.0, 1.0]]) / 8.0
_OFF_MIDDLE = np.array([0.18343464249564978, 0.525532409916329, 0.7966664774136267, 0.9602898564975362])
_WEIGHTS = np.array([0.36268378337836166, 0.3137066458778869, 0.22238103445337443, 0.10122853629037706])
_WEIGHTS = 0.25 * np.concatenate([_WEIGHTS, _WEIGHTS])
_NODES = np.add.outer([0.25, 0.75], 0.25 * np.concatenate([-_OFF_MIDDLE, _OFF_MIDDLE]))
"""Nodes of Gauss and Legendre over both halves of 0..1, with the weights over a half."""
_SQUARES = np.stack([0.5 * (1.0 - _NODES) ** 2, 0.5 + _NODES - _NODES**2, 0.5 * _NODES**2], axis=2)
"""Factors of the coefficients of a quadratic B-spline in its values at the nodes."""
AT_START = Front(np.zeros(1), np.empty((6, 0)), np.zeros(3), np.empty(0), np.empty(0))
"""The front of a trajectory that begins from rest."""


class Trajectory:
    """Joint positions (rad) over time, from time 0 to rest at the target of its last move at `end_s`."""

    def __init__(
        self,
        path: BlendedPath,
        times: Array,
        quintics: Array,
        controls: Array | None = None,
        profile: Array | None = None,
    ) -> None:
        """`controls` (N + 3,) of x and `profile` (N + 2,) belong to N segments.

        The last 2 N quintics are the halves of these segments.
        """
        self.path = path
        self.moves: Sequence[Move] = path.moves
        self.end: Joints = path.moves[-1].path.end
        """Joint positions (rad) at its end."""
        self.times = times
        self.end_s = float(times[-1])
        self.front_s = float(times[0])
        """Up to this time (s) its motion is that of the trajectory it was planned from."""
        self._quintics = quintics
        self._controls, self._profile = controls, profile
        self._lengths = times[1:] - times[:-1]
        self._at: tuple[float, Joints] = 0.0, ()  # asked for last

    def sample(self, times: Array) -> Array:
        """Return joint positions (m, n), in rad, at times (m,), in s."""
        return self.path.positions(self._places(times))

    def joints(self, time_s: float) -> Joints:
        """Return joint positions (rad) at a time (s)."""
        if time_s >= self.end_s:
            return self.end
        if time_s <= 0.0:
            return self.moves[0].path.start
        if time_s != self._at[0]:
            self._at = time_s, tuple(self.sample(np.array([time_s]))[0].tolist())
        return self._at[1]

    def state(self, time_s: float) -> State:
        """Return joint positions (rad), velocities and accelerations at a time (s)."""
        times = np.array([time_s])
        speed, bend = (rate.item() for rate in self._rates(times))
        q, first, second, _ = self.path.derivatives(self._places(times))[0][0]
        velocity, acceleration = first * speed, second * speed**2 + first * bend
        return tuple(q.tolist()), tuple(velocity.tolist()), tuple(acceleration.tolist())

    def x(self, time_s: float) -> float:
        """Return the place on its path at a time (s)."""
        time_s = max(time_s, 0.0)
        k = max(int(self.times[:-1].searchsorted(time_s, side="right")) - 1, 0)
        u = min((time_s - self.times.item(k)) / self._lengths.item(k), 1.0)
        p0, p1, p2, p3, p4, p5 = self._quintics[:, k].tolist()
        x = p0 + u * (p1 + u * (p2 + u * (p3 + u * (p4 + u * p5))))
        return float(min(max(x, self.path.first_x), self.path.end_x))

    def move_at(self, time_s: float) -> Move:
        """Return the move that runs at a time (s); in a blend it is the second one from its target on."""
        return self.moves[self._index_at(time_s)]

    def moves_from(self, time_s: float) -> Sequence[Move]:
        """Return the move that runs at a time (s) and those behind it."""
        return self.moves[self._index_at(time_s) :]

    def _index_at(self, time_s: float) -> int:
        if len(self.moves) == 1 or time_s >= self.end_s:
            return len(self.moves) - 1
        return bisect_right(self.path.borders, self.x(time_s), 1, len(self.moves)) - 1

    def _parts(self, times: Array) -> tuple[Array, Array, Array]:
        """Return coefficients (6, m) of the quintics at times (m,), their lengths (s), and the parts done."""
        k = np.maximum(self.times[:-1].searchsorted(times, side="right") - 1, 0)
        lengths = self._lengths[k]
        return self._quintics.take(k, axis=1), lengths, np.minimum((times - self.times[k]) / lengths, 1.0)

    def _places(self, times: Array) -> Array:
        """Return x (m,) at times (m,), not before 0."""
        p, _, u = self._parts(times)
        x = p[0] + u * (p[1] + u * (p[2] + u * (p[3] + u * (p[4] + u * p[5]))))
        within: Array = x.clip(self.path.first_x, self.path.end_x)
        return within

    def _rates(self, times: Array) -> tuple[Array, Array]:
        """Return dx/dt (1/s) and d2x/dt2 (1/s^2) at times (m,), not before 0."""
        p, h, u = self._parts(times)
        first = p[1] + u * (2.0 * p[2] + u * (3.0 * p[3] + u * (4.0 * p[4] + u * (5.0 * p[5]))))
        second = 2.0 * p[2] + u * (6.0 * p[3] + u * (12.0 * p[4] + u * (20.0 * p[5])))
        return first / h, second / (h * h)

    def front(self, now_s: float, time_s: float, free_s: float, until_x: float) -> Front:
        """Return what to keep of the trajectory when it is extended at `now_s`.

        Its motion stays up to the first knot behind `time_s`, or up to `free_s` before it brakes at its end
        if that is later. x stays longer: up to a little before it brakes, or before the run whose mean it is
        reaches `until_x`.
        """
        speeds = np.append(self._quintics[1] / self._lengths, 0.0)
        rising = (speeds[1:] >= speeds[:-1] * (1.0 - 1e-12)).nonzero()[0]
        brakes_s = float(self.times[rising[-1] + 1]) if len(rising) else 0.0
        wanted_s = max(time_s, brakes_s - free_s)
        if self._controls is None or self._profile is None:
            return self._front_at(now_s, wanted_s)
        begin = len(self.times) + 5 - 2 * len(self._controls)  # knot of the first segment
        times = self.times[begin::2]
        most = len(times) - 2
        k = max(min(int(times.searchsorted(wanted_s)), most), 0 if begin else 1)
        until_s = max(brakes_s - BESIDE_BRAKING_S, 0.5 * (brakes_s + times[k]))
        last = min(int(times.searchsorted(until_s)), most)
        ahead = np.append(self._quintics[0, begin::2], self.path.end_x)
        ahead += 0.5 * self.path.window_s * speeds[begin::2]
        last = min(last, int(ahead[: last + AHEAD_SEGMENTS].searchsorted(until_x)) - AHEAD_SEGMENTS)
        last = max(last, k)
        return Front(
            *self._before(now_s, begin + 2 * k),
            self._controls[k : last + 3],
            self._profile[k : last + 2],
            np.diff(times[last : last + 3]),
        )

    def _before(self, now_s: float, k: int) -> tuple[Array, Array]:
        """Return times and quintics up to the knot k that may still be needed."""
        first = max(min(int(self.times.searchsorted(now_s - KEPT_S)) - 1, k - 1), 0)
        return self.times[first : k + 1], self._quintics[:, first:k]

    def _front_at(self, now_s: float, wanted_s: float) -> Front:
        """Return the front at any time of a motion in closed form.

        While the acceleration decreases to 0, only the running motion keeps the limits: not there.
        """
        h = SEGMENT_S
        time_s = min(wanted_s, max(self.end_s - h, 0.5 * self.end_s))
        easing = int(((self._quintics[3] < 0.0) & (self._quintics[2] > 0.0)).argmax())
        if self.times[easing] - 2.0 * h < time_s < self.times[easing + 1]:
            time_s = float(self.times[easing + 1])
        at = np.array([time_s])
        x, speed, bend = self._places(at).item(), *(rate.item() for rate in self._rates(at))
        middle, first, half = x - bend * h * h / 6.0, speed * h, 0.5 * bend * h * h
        controls = np.array([middle - first + half, middle, middle + first + half])
        # The running quintic ends at the front.
        k = max(int(self.times.searchsorted(time_s)), 1)
        times, quintics = self._before(now_s, k)
        times, quintics = times.copy(), quintics.copy()
        quintics[:, -1] *= ((time_s - times[-2]) / (times[-1] - times[-2])) ** np.arange(6.0)
        times[-1] = time_s
        return Front(times, quintics, controls, np.full(2, (UNIT_S / h) ** 2), np.full(2, h))


def planned(path: BlendedPath, front: Front) -> Slices[Trajectory | None]:
    """Return a trajectory that continues from a front; None if none was found that keeps the limits."""
    yield
    continues = len(front.profile) > 0
    controls = front.controls if continues else front.controls + path.first_x
    motion = yield from nominal(path, controls, front.state if continues else None, front.lengths_s)
    if motion is None:
        return None
    x, lengths_s = motion
    yield
    profile = yield from sampled(path, x, front.profile, max(len(front.profile) - 2, 0))
    guess(profile, lengths_s / UNIT_S)
    yield
    if not (yield from fastest(profile)):
        return None
    return (yield from _timed(path, x, profile.coefficients, front))


def alone(move: Move) -> Slices[Trajectory]:
    """Return the trajectory of one move from rest to rest."""
    path = BlendedPath([move], [])
    if move.path.straight:
        return _rest_to_rest(path)
    found = yield from planned(path, AT_START)
    assert found is not None
    return found


def planned_on(
    trajectory: Trajectory, now_s: float, time_s: float, moves: Sequence[Move], blends: Sequence[Blend]
) -> Slices[Trajectory | None]:
    """Return a trajectory, unchanged from now up to a time, faster after it, extended into moves.

    Blends that have begun by then are made smaller. Return None if that is too late, or if none keeps the
    limits.
    """
    path = trajectory.path
    begins = blends[0].before * path.moves[-1].length_s if blends else 0.0
    front = trajectory.front(now_s, time_s, FREE_S, path.end_x - begins)
    if blends:
        share = (path.end_x - sets_out(path, front.state)[0]) / begins
        if share < 1.0:
            share *= LATE
            if share < LEAST_BLEND:
                return None
            before, after, rho = blends[0]
            blends = [Blend(share * before, share * after, rho), *blends[1:]]
    return (yield from planned(_gone_on(path, float(front.quintics[0, 0]), moves, blends), front))


def ending(trajectory: Trajectory, now_s: float) -> Trajectory | None:
    """Return a trajectory that continues from now and ends with the running move.

    Return None if it will have begun to leave that move's path, or if no profile brings it to rest in time.
    In the latter case it mostly is too fast to stop at that target.
    """
    move = trajectory.move_at(now_s)
    leaves_x = float(blend_spans(trajectory.path)[0][trajectory.moves.index(move)])
    # The part of x that stays must not end beside a blend, where it is too fast to rest at the target.
    until_x = min(leaves_x, trajectory.x(now_s + LITTLE_KEPT_S))
    front = trajectory.front(now_s, now_s, trajectory.end_s, until_x)
    if front.state[0] >= leaves_x:
        return None
    path = _gone_on(trajectory.path, float(front.quintics[0, 0]), [], [])
    count = path.moves.index(move) + 1
    path = BlendedPath(path.moves[:count], path.blends[: count - 1], path.first_x, path.window_s)
    return at_once(planned(path, front))


def _gone_on(path: BlendedPath, x: float, moves: Sequence[Move], blends: Sequence[Blend]) -> BlendedPath:
    """Return the path from an x on, with more moves at its end, each behind a blend."""
    gone = int((blend_spans(path)[1] <= x).sum())
    left, left_blends = [*path.moves[gone:], *moves], [*path.blends[gone:], *blends]
    return BlendedPath(left, left_blends, path.borders[gone], path.window_s)


def at_once(slices: Slices[T]) -> T:
    """Return the result of work in slices, run to its end within this tick."""
    while True:
        try:
            next(slices)
        except StopIteration as end:
            result: T = end.value
            return result


def _timed(path: BlendedPath, x: Array, profile: Array, front: Front) -> Slices[Trajectory]:
    """Return the trajectory behind a front of x, a cubic B-spline (N + 3,), and its profile (N + 2,)."""
    if len(x) > MANY_SEGMENTS:
        yield
    b = profile / UNIT_S**2
    windows = np.array([x[:-3], x[1:-2], x[2:-1], x[3:], b[:-2], b[1:-1], b[2:]])
    # The time over half a segment is the integral of 1 / sqrt(b).
    roots = _SQUARES @ windows[4:]
    np.sqrt(roots, out=roots)
    lengths = (_WEIGHTS @ np.divide(1.0, roots, out=roots)).ravel(order="F")
    times = front.times[-1] + np.concatenate([[0.0], lengths.cumsum()])
    if len(x) > 4 * MANY_SEGMENTS:
        yield
    # x, dx/dt and half of d2x/dt2 at the ends of halves.
    halves = (_AT_HALVES @ windows).reshape(5, 2, -1).swapaxes(1, 2).reshape(5, -1)
    place, first, second, b, slope = halves
    states = np.empty((3, len(times)))
    states[0, :-1], states[1, :-1], states[2, :-1] = place, first * np.sqrt(b), second * b + first * slope
    states[:, -1] = path.end_x, 0.0, 0.0
    scales = np.array([np.ones_like(lengths), lengths, lengths * lengths])
    quintics = _HERMITE @ np.concatenate([states[:, :-1] * scales, states[:, 1:] * scales])
    all_times = np.concatenate([front.times[:-1], times])
    quintics = np.concatenate([front.quintics, quintics], axis=1)
    found = Trajectory(path, all_times, quintics, x, profile)
    found.front_s = float(front.times[-1])
    return found


def _rest_to_rest(path: BlendedPath) -> Trajectory:
    """Return the fastest trajectory of one straight move, along which x moves as one joint would."""
    move, distance = path.moves[0], path.end_x
    distances = np.maximum(np.abs(np.subtract(move.path.end, move.path.start)), STILL)
    velocity, acceleration, jerk = (distance * (np.array(move.limits) / distances).min(axis=1)).tolist()
    # The velocity that it reaches in half of the distance, with full acceleration or without.
    full = acceleration * acceleration / jerk
    top = 0.5 * (sqrt(full * full + 4.0 * acceleration * distance) - full)
    if top < full:
        top = (0.25 * jerk * distance * distance) ** (1.0 / 3.0)
    top = min(top, velocity)
    building = min(acceleration / jerk, sqrt(top / jerk))
    even = max(top / (building * jerk) - building, 0.0)
    cruise = max(distance / top - 2.0 * building - even, 0.0)
    lengths = np.array([building, even, building, cruise, building, even, building])
    quintics, x, speed, bend = np.zeros((6, 7)), 0.0, 0.0, 0.0
    for k, sign in enumerate((1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)):
        h = lengths.item(k)
        quintics[:4, k] = x, speed * h, 0.5 * bend * h * h, sign * jerk * h**3 / 6.0
        x, speed = x + quintics[1:4, k].sum(), speed + (bend + 0.5 * sign * jerk * h) * h
        bend += sign * jerk * h
    times = np.concatenate([[0.0], lengths.cumsum()])
    lasts = lengths > 1e-12
    return Trajectory(path, np.append(times[:-1][lasts], times[-1]), quintics[:, lasts])
