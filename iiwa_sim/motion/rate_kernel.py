"""The fastest change of the rate at which a plan runs that keeps the limits of all joints.

At the rate r of planned time, with the slope p = r' and the bend c = r'', a joint with the planned velocity
v, acceleration a and jerk j sees the acceleration r^2 a + p v and the jerk r^3 j + 3 r p a + c v. Over a
short cell of time c is constant. In each cell the largest c toward the goal is taken from which there is a
way out: a *release*, in which p goes back to 0 as fast as limits allow, and comes to 0 before the rate has
passed the goal. At p = 0 every rate up to 1 keeps the limits, wherever the plan goes. So there always is a
way on.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython

STEP_S = 0.001
"""Between places of a plan."""
_STEP_S = cython.declare(cython.double, 0.001)
# Part of the limits of acceleration and jerk that may be used; where a plan uses more, so may the change.
_ALLOWED = cython.declare(cython.double, 1.005)
SPREAD = 1
"""Places beside either end of a cell that also keep the limits: a release is found before its cells come."""
_SPREAD = cython.declare(cython.Py_ssize_t, 1)
_ROUNDING = cython.declare(cython.double, 1e-9)  # of rates
_HARDLY = cython.declare(cython.double, 1e-13)  # moving, of limits
_RELEASE_CELLS = cython.declare(cython.Py_ssize_t, 400)
_NONE = cython.declare(cython.double, -1e9)  # instead of a rate
_HALVINGS = cython.declare(cython.Py_ssize_t, 7)
_LANDINGS = cython.declare(cython.Py_ssize_t, 14)  # at most, to come to the goal to rounding


@cython.cclass
class LoadsAhead:
    """Loads of a plan each `STEP_S` of planned time from `first_s` on, and how its rate may change.

    `loads` (m, 6 n) has rows of velocity and acceleration over the acceleration limit (s, 1), and of
    velocity, acceleration, and the least and the largest jerk up to the next place over the jerk limit (s^2,
    s, 1, 1), n values each. `SPREAD` more rows on either side of a cell are to keep the limits: what is
    promised for a later cell then holds for what is looked at when that comes.

    A stop may come at any time, with its own limits of slope and bend: no slope or bend is larger than those,
    and a rate that rises is never so much on its way up that the stop would take longer than from a rate of 1
    by more than `stop_slack_s`.
    """

    loads: cython.double[:, ::1]
    count: cython.Py_ssize_t
    joints: cython.Py_ssize_t
    first_s: cython.double
    cell_s: cython.double
    largest_slope: cython.double
    largest_bend: cython.double
    stop_slack_s: cython.double
    low: cython.double
    high: cython.double

    def __init__(
        self,
        loads: cython.double[:, ::1],
        first_s: cython.double,
        cell_s: cython.double,
        largest_slope: cython.double,
        largest_bend: cython.double,
        stop_slack_s: cython.double,
    ) -> None:
        self.loads = loads
        self.count = loads.shape[0]
        self.joints = loads.shape[1] // 6
        self.first_s = first_s
        self.cell_s = cell_s
        self.largest_slope = largest_slope
        self.largest_bend = largest_bend
        self.stop_slack_s = stop_slack_s
        self.low = self.high = 0.0

    @cython.ccall
    def bend(
        self, time_s: cython.double, rate: cython.double, slope: cython.double, goal: cython.double
    ) -> cython.double:
        """The bend (1/s^2) of the next cell, which begins at a planned time, a rate and its slope (1/s)."""
        end: cython.double = rate
        beyond: cython.double = 0.0
        if slope == 0.0:
            if rate == goal:
                return 0.0
            sign = 1.0 if goal > rate else -1.0
            out = 0.0
        else:
            sign = 1.0 if slope > 0.0 else -1.0
            out = self._out(time_s, rate, slope)
            end = self._released(time_s, rate, slope)
            if end == _NONE or (goal - end) * sign <= _ROUNDING:
                return out
        left = (goal - end) * sign  # of the way, if the release began with `out`
        self._narrow(time_s, rate, slope)
        best = self.high if sign > 0.0 else self.low
        if best * sign <= out * sign:
            return out
        end = self._after(time_s, rate, slope, best)
        if end != _NONE:
            beyond = (end - goal) * sign  # if it began with `best`; 0 where limits are the matter
            if beyond <= 0.0:
                return best
        for tries in range(_LANDINGS):
            if beyond > 0.0:
                # Where it ends is known of both: by the false position, the side that stays counted for half.
                middle = out + (best - out) * left / (left + beyond)
            elif tries >= _HALVINGS:
                return out
            else:
                middle = 0.5 * (out + best)
            end = self._after(time_s, rate, slope, middle)
            if end == _NONE:
                best, beyond = middle, 0.0
            elif (end - goal) * sign > 0.0:
                best, beyond = middle, (end - goal) * sign
                left *= 0.5
            else:
                out, left = middle, (goal - end) * sign
                beyond *= 0.5
                if left <= 0.1 * _ROUNDING:
                    return out
        return out

    @cython.cfunc
    @cython.exceptval(check=False)
    def _after(
        self, time_s: cython.double, rate: cython.double, slope: cython.double, bend: cython.double
    ) -> cython.double:
        """The rate at which a release after a cell with this bend ends, _NONE where there is none."""
        h: cython.double = self.cell_s
        after: cython.double = slope + h * bend
        rate_after: cython.double = rate + h * (slope + 0.5 * h * bend)
        return self._released(time_s + h * (rate + h * (0.5 * slope + h * bend / 6.0)), rate_after, after)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _out(self, time_s: cython.double, rate: cython.double, slope: cython.double) -> cython.double:
        """The bend that takes the slope back to 0 as fast as limits allow, and no farther."""
        wanted: cython.double = -slope / self.cell_s
        self._narrow(time_s, rate, slope)
        if self.low > self.high:
            return 0.5 * (self.low + self.high)
        if wanted > self.high:
            return self.high
        if wanted < self.low:
            return self.low
        return wanted

    @cython.cfunc
    @cython.exceptval(check=False)
    def _released(self, time_s: cython.double, rate: cython.double, slope: cython.double) -> cython.double:
        """The rate at which the slope has come back to 0, _NONE where limits do not allow it."""
        h: cython.double = self.cell_s
        for _ in range(_RELEASE_CELLS):
            if slope == 0.0:
                return rate
            wanted = -slope / h
            self._narrow(time_s, rate, slope)
            if self.low > self.high:
                return _NONE
            bend = wanted
            if bend > self.high:
                bend = self.high
            if bend < self.low:
                bend = self.low
            time_s += h * (rate + h * (0.5 * slope + h * bend / 6.0))
            rate += h * (slope + 0.5 * h * bend)
            slope = 0.0 if bend == wanted else slope + h * bend
        return _NONE

    @cython.cfunc
    @cython.exceptval(check=False)
    def _narrow(self, time_s: cython.double, rate: cython.double, slope: cython.double) -> cython.void:
        """Leaves in `low` and `high` the bends that keep all limits in all of a cell."""
        h: cython.double = self.cell_s
        n: cython.Py_ssize_t = self.joints
        then: cython.double = rate + h * slope
        if then < 0.0:
            then = 0.0
        on: cython.double = h * rate
        if then > rate:
            on = h * then
        first: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (time_s - self.first_s) / _STEP_S)
        last: cython.Py_ssize_t = 1 + cython.cast(cython.Py_ssize_t, (time_s + on - self.first_s) / _STEP_S)
        # A stop from a rising rate first takes slope / bend to end that, in which the rate rises by half of
        # slope^2 / bend: with slopes up to the largest that costs at most 1.5 slope / bend.
        top: cython.double = self.largest_bend / 1.5 * ((1.0 - then) / self.largest_slope + self.stop_slack_s)
        if top > self.largest_slope:
            top = self.largest_slope
        self.low = (-self.largest_slope - slope) / h
        self.high = (top - slope) / h
        if self.low < -self.largest_bend:
            self.low = -self.largest_bend
        if self.high > self.largest_bend:
            self.high = self.largest_bend
        first -= _SPREAD
        last += _SPREAD
        if first < 0:
            first = 0
        if last >= self.count:
            self.low, self.high = 1.0, -1.0
            return
        for k in range(first, last + 1):
            for i in range(n):
                part = 3.0 * self.loads[k, 3 * n + i]
                for e in range(4, 6):
                    jerk = self.loads[k, e * n + i]
                    self._keep(rate * (rate * rate * jerk + slope * part), self.loads[k, 2 * n + i], jerk)
                    self._keep(
                        then * (then * then * jerk + slope * part),
                        self.loads[k, 2 * n + i] + then * h * part,
                        jerk,
                    )
                part = self.loads[k, n + i]
                self._keep(then * then * part + slope * self.loads[k, i], h * self.loads[k, i], part)
            if self.low > self.high:
                return

    @cython.cfunc
    @cython.exceptval(check=False)
    def _keep(self, load: cython.double, per_bend: cython.double, planned: cython.double) -> cython.void:
        """Narrows the bends to those with which a load stays within what is allowed, or planned."""
        allowed: cython.double = _ALLOWED
        if planned > allowed:
            allowed = planned
        elif -planned > allowed:
            allowed = -planned
        low = load + per_bend * self.low
        high = load + per_bend * self.high
        if -allowed <= low <= allowed and -allowed <= high <= allowed:
            return
        if -_HARDLY < per_bend < _HARDLY:
            if load > allowed + _ROUNDING or load < -allowed - _ROUNDING:
                self.low, self.high = 1.0, -1.0
            return
        if per_bend > 0.0:
            low, high = (-allowed - load) / per_bend, (allowed - load) / per_bend
        else:
            low, high = (allowed - load) / per_bend, (-allowed - load) / per_bend
        if low > self.low:
            self.low = low
        if high < self.high:
            self.high = high
