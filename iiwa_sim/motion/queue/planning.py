"""Plans a chain: along a course, from a front on."""

from collections.abc import Sequence
from math import isfinite

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path.ptp import ptp
from iiwa_sim.motion.profile_kernel import UNIT_S
from iiwa_sim.motion.queue.chain import Chain, Front
from iiwa_sim.motion.queue.chain_kernel import JointPath
from iiwa_sim.motion.queue.corner import Corner
from iiwa_sim.motion.queue.course import Course
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.straight_kernel import Evenly
from iiwa_sim.motion.slices import Slices, T
from iiwa_sim.motion.speed_profile import fastest, guess, quick, sampled
from iiwa_sim.motion.timing.run_kernel import caps, moving_average, phases, rest_to_rest, run
from iiwa_sim.motion.timing.widths_kernel import switches, widths

FREE_S = 0.4
"""A chain that goes on is planned anew from so long before it brakes at its end."""
LATE = 0.95
"""Part of what is left of a corner that is used, where the robot is past the beginning of the whole one."""
LITTLE_KEPT_S = 0.04
"""So much is kept of x where a chain is to end sooner, and no clock was found with more of it."""
LEAST_CORNER = 0.1
"""Where less than this part of a corner is left, it is too late for it."""
STRAIGHT_ENOUGH = 0.001
"""For a move whose joints go straight: part of the time that may be left to gain, by what multipliers say."""
MANY_CELLS = 400
"""A move whose joints go straight, and that would have more cells, has wider ones where nothing happens."""
NOWHERE_S = np.empty(0)
MANY_SAMPLES = 400
"""A nominal motion of fewer samples of x is planned in one slice."""
STILL = 1e-12
"""rad per unit of x: a joint that goes less bounds nothing."""
SHORTEST_S = 1e-4
"""A shorter cell means that hardly more is left than the cells that are kept: it is too late to plan."""


def planned(course: Course, front: Front) -> Slices[Chain | None]:
    """A chain along a course, which goes on from a front; None where none was found that keeps the limits."""
    yield
    nominal = yield from _nominal(course, front)
    if nominal is None:
        return None
    controls, cells_s = nominal
    frozen = front.frozen
    yield
    old = front.clock[frozen:] if frozen else front.clock[:0]
    profile = yield from sampled(course.way, controls[frozen:], old, front.kept if frozen else 0)
    guess(profile, cells_s)
    yield
    if not (yield from fastest(profile)):
        return None
    c = profile.coefficients
    return Chain(course, controls, np.concatenate([front.clock[:frozen], c]), front.times[: frozen + 1])


def begun(move: Move) -> Chain:
    """A chain of one move, to set out with: rough, and to be planned on, where more would take too long."""
    course, front = Course([move], []), Front.at_start()
    if move.path.straight:
        return _straight(course)
    controls, cells_s = _checked(at_once(_nominal(course, front)))
    profile = at_once(sampled(course.way, controls))
    if not profile.finite:
        raise ArithmeticError(f"move {move.number}: no joint positions along its path")
    guess(profile, cells_s)
    rough = not quick(profile, cells_s)
    return Chain(course, controls, profile.coefficients, front.times, rough)


def planned_on(
    chain: Chain, now_s: float, time_s: float, moves: Sequence[Move], corners: Sequence[Corner]
) -> Slices[Chain | None]:
    """A chain, unchanged from now up to a time, faster after it, and going on into moves round corners.

    Corners that have begun by then are made smaller; None where that is too late, or no way on keeps the
    limits.
    """
    course = chain.course
    begins = corners[0].before * course.moves[-1].length_s if corners else 0.0
    front = chain.front(now_s, time_s, chain.rest_s if chain.rough else FREE_S, course.end_x - begins)
    if corners:
        share = (course.end_x - _set_out(course, front)[0]) / begins
        if share < 1.0:
            share *= LATE
            if share < LEAST_CORNER:
                return None
            corner = corners[0]
            corners = [
                corner._replace(before=share * corner.before, after=share * corner.after),
                *corners[1:],
            ]
    return (yield from planned(course.gone_on(front.first_x, moves, corners), front))


def ending(chain: Chain, now_s: float, time_s: float) -> Chain | None:
    """A chain, unchanged from now up to a time, that ends with the move under way.

    None where it will have begun to leave that move's path, or no clock brings it to rest in time: then it
    mostly is too fast, as it would not have had to stop at that target.
    """
    if not chain.waiting(now_s):
        return chain
    move = chain.move_at(now_s)
    leaves_x = chain.course.leaves_x(move)
    # What is kept of x may end beside a corner, where it is too fast to rest at the target.
    for until_x in (leaves_x, min(leaves_x, chain.x(time_s + LITTLE_KEPT_S))):
        front = chain.front(now_s, time_s, chain.rest_s, until_x)
        course = chain.course.ending(front.first_x, move, front.state[0])
        found = at_once(planned(course, front)) if course else None
        if found is not None:
            return found
    return None


def at_once(slices: Slices[T]) -> T:
    """What a plan in slices comes to, run to its end within this tick."""
    while True:
        try:
            next(slices)
        except StopIteration as end:
            result: T = end.value
            return result


def _set_out(course: Course, front: Front) -> tuple[float, float]:
    """x and dx/dt (1/s) of the run at the time when its moving average is at the front."""
    half_s = 0.5 * course.window_s
    x, speed, acceleration = front.state
    return x + half_s * speed + acceleration * half_s**2 / 3.0, speed + half_s * acceleration


def _nominal(course: Course, front: Front) -> Slices[tuple[Array, Array] | None]:
    """x as a B-spline over cells from the front's first on, and the nominal times of cells behind it.

    None where it is too late to plan anything.
    """
    window_s = course.window_s
    if front.frozen:
        x, speed = _set_out(course, front)
        # The run whose mean is where the front is, as fast, with the same acceleration.
        _, mean_speed, bend = front.state
        earlier = x - window_s * mean_speed, mean_speed - 0.5 * window_s * bend
        if x >= course.end_x or speed < 0.0:
            return None
    else:
        x, speed, earlier = course.first_x, 0.0, (course.first_x, 0.0)
    samples: Array = course.way.samples(x)
    many = len(samples) > MANY_SAMPLES
    if many:
        yield
    found, limits = course.at(samples)
    if many:
        yield
    # The run, behind where it was a window before, and scratch.
    x_then, speeds, times, scratch = np.empty((4, len(samples) + 1))
    x_then[0], speeds[0], times[0] = *earlier, -window_s
    x_then[1:] = samples
    caps(found, limits, scratch[1:])
    run(samples, found, limits, scratch[1:], 0.0, speed, speeds[1:], times[1:])
    if many:
        yield
    cells_s = _widths(course, samples, times[1:], speeds[1:], front)
    if cells_s.min() < SHORTEST_S:
        return None
    if many:
        yield
    knots_s, mean = np.zeros(len(cells_s) + 1), np.empty((len(cells_s) + 1, 3))
    cells_s.cumsum(out=knots_s[1:])
    moving_average(x_then, speeds, times, scratch, window_s, knots_s, mean)
    return _through(front.controls, mean, cells_s, course.end_x), cells_s


def _through(before: Array, motion: Array, cells_s: Array, end_x: float) -> Array:
    """Return the coefficients (k + N,) of x as a cubic B-spline that go on from those before (k,).

    `motion` (N + 1, 3) is x and its first two derivatives over time at the knots. x never goes back.
    """
    # The coefficient of a knot is its value without a sixth of its second derivative over theta.
    widths, changes = 0.5 * (cells_s[1:-2] + cells_s[2:-1]), cells_s[2:-1] - cells_s[1:-2]
    x, first, second = motion[2:-2].T
    inner = x - (second * (widths * widths) + first * changes) / 6.0
    found: Array = np.concatenate([before, inner, np.full(3, end_x)])
    new = found[len(before) - 1 :]
    falls = new[1:] < new[:-1]
    if falls.any():
        # Cells are too wide for how x changes: coefficients go between the values at the knots beside theirs.
        means = 0.5 * (motion[1:-2, 0] + motion[2:-1, 0])
        inside = np.minimum(np.maximum(new[1:-3], means[:-1]), means[1:])
        new[1:-3] = np.where(falls[:-3] | falls[1:-2], inside, new[1:-3])
        new[1:-3] = np.minimum(np.maximum.accumulate(new[:-3])[1:], new[-1])
    return found


def _straight(course: Course) -> Chain:
    """The chain of one move whose joints go straight: x moves as one joint would."""
    move = course.moves[0]
    ways = np.maximum(np.abs(np.subtract(move.path.end, move.path.start)), STILL)
    limits = course.end_x * (np.array(move.limits) / ways).min(axis=1)
    lengths, jerks = np.empty(7), np.empty(7)
    velocity, acceleration, jerk = limits.tolist()
    end_s = rest_to_rest(course.end_x, velocity, acceleration, jerk, lengths, jerks)
    if not isfinite(end_s):
        raise ArithmeticError(f"move {move.number}: no joint positions along its path")
    evenly = Evenly(course.end_x, velocity, acceleration, jerk, *lengths[:2].tolist())
    if evenly.cells(end_s) > MANY_CELLS:
        controls, c = _long(course.end_x, limits, lengths, jerks)
    else:
        controls, c = evenly.found(end_s, UNIT_S)
    return Chain(course, controls, c, np.zeros(1))


def _long(end_x: float, limits: Array, lengths: Array, jerks: Array) -> tuple[Array, Array]:
    """x from rest to rest, within limits (3,), through phases that last so long (7,) at such jerks (7,), and
    its clock: in cells that are wider where nothing happens for long."""
    none = np.empty(0)
    cells_s: Array = widths(float(lengths.sum()), none, none, lengths.cumsum()[:-1], none)
    knots_s, motion = np.zeros(len(cells_s) + 1), np.empty((len(cells_s) + 1, 3))
    cells_s.cumsum(out=knots_s[1:])
    phases(lengths, jerks, knots_s, motion)
    controls = _through(np.zeros(3), motion, cells_s, end_x)
    # The clock is planned for one joint, which is x.
    profile = at_once(sampled(_as_one_joint(end_x, limits), controls))
    guess(profile, cells_s)
    at_once(fastest(profile, STRAIGHT_ENOUGH))
    return controls, profile.coefficients


def _as_one_joint(end_x: float, limits: Array) -> JointPath:
    """The way of a joint that goes from 0 to `end_x` as x does, with its limits (3,)."""
    none = np.zeros(2)
    path = ptp((0.0,), (end_x,))
    return JointPath(np.array([0.0, end_x]), none, none, np.ones(2), [path], limits.reshape(1, 3, 1))


def _checked(nominal: tuple[Array, Array] | None) -> tuple[Array, Array]:
    assert nominal is not None
    return nominal


def _widths(course: Course, samples: Array, times: Array, speeds: Array, front: Front) -> Array:
    """Nominal times (s) of the cells behind the front."""
    half_s = 0.5 * course.window_s
    enter = leave = NOWHERE_S
    if len(course.moves) > 1:
        first, last = course.corner_spans()
        enter, leave = np.interp(first, samples, times) + half_s, np.interp(last, samples, times) + half_s
        ahead = leave > 0.0
        enter, leave = enter[ahead], leave[ahead]
    events = switches(times, speeds) + half_s
    found: Array = widths(float(times[-1]) + 2.0 * half_s, enter, leave, events, front.cells_s)
    return found
