"""How a chain is planned: along a course, from a front on."""

from collections.abc import Sequence
from math import isfinite

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.chain import Chain, Front
from iiwa_sim.motion.queue.corner import Corner
from iiwa_sim.motion.queue.course import Course
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.rows import UNIT_S, rows_along
from iiwa_sim.motion.slices import Slices, at_once
from iiwa_sim.motion.timing.clock import fastest, guess, quick, steady
from iiwa_sim.motion.timing.run_kernel import caps, moving_average, run

CELL_S = 0.01
"""Nominal time of a cell,"""
LEAST_CELLS = 16
"""but a chain has no fewer,"""
CORNER_CELLS = 12.0
"""and a corner has about so many: its accelerations come and go within some of them."""
SHORTEST_CELL_S = 0.0025
BESIDE_S = 0.08
"""So fast cells may change."""
FREE_S = 0.4
"""Before a chain brakes at its end: from there on it is planned anew when it goes on."""
LATE = 0.95
"""A corner that would have begun too early begins so near to what is left of it,"""
LEAST_CORNER = 0.1
"""and is none where less is left."""
NEAR_S = 0.2
"""Farther than this from corners and ends, cells become longer,"""
WIDER = 0.1
"""in the end by this part of how far it is."""
GRID_PER_S = 1000.0
STILL = 1e-12
"""rad per unit of x: a joint that goes less bounds nothing."""
SEAM = 5.0
"""Cells in which nominal times go over from those before the front."""
GROW = float(np.exp(1.0 / SEAM))
LEAST_PART = 0.2
SHORTEST_S = 1e-4
"""So short is no cell: where hardly more is left than the cells that are kept, it is too late to plan."""
SMOOTH = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0


def planned(course: Course, front: Front) -> Slices[Chain | None]:
    """A chain along a course that goes on from a front; None where none was found that keeps the limits."""
    nominal = yield from _nominal(course, front)
    if nominal is None:
        return None
    controls, widths = nominal
    frozen = front.frozen
    yield
    rows = yield from rows_along(course, controls[frozen:], front.rows)
    if frozen:
        # As before as far as x is kept, then at an even pace.
        c = np.concatenate([front.clock[frozen:-2], guess(rows, widths / UNIT_S, front.clock[-2:])])
    else:
        c = steady(rows, widths / UNIT_S)
    if not (yield from fastest(rows, c, 2 if frozen else 0, front.kept if frozen else 0)):
        return None
    return Chain(course, controls, np.concatenate([front.clock[:frozen], c]), front.times[: frozen + 1], rows)


def begun(move: Move) -> Chain:
    """A chain of one move, planned quickly: to set out with, and to be planned on."""
    course, front = Course([move], []), Front.at_start()
    straight = len(move.path.coefficients) == 2
    controls, widths = _straight(course) if straight else _checked(at_once(_nominal(course, front)))
    rows = at_once(rows_along(course, controls, None))
    c = steady(rows, widths / UNIT_S)
    if not isfinite(float(rows.j3.sum())):
        raise ArithmeticError(f"move {move.number}: no joint positions along its path")
    rough = not quick(rows, c)
    return Chain(course, controls, c, front.times, rows, rough)


def planned_on(
    chain: Chain, now_s: float, time_s: float, moves: Sequence[Move], corners: Sequence[Corner]
) -> Slices[Chain | None]:
    """The same chain from now up to a time, faster after it, and going on into moves round corners.

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
    """The same chain from now up to a time that ends with the move under way; None where it will have begun
    to leave its path, or no clock brings it to rest in time."""
    if not chain.waiting(now_s):
        return chain
    move = chain.move_at(now_s)
    front = chain.front(now_s, time_s, chain.rest_s, chain.course.leaves_x(move))
    course = chain.course.ending(front.first_x, move, front.state[0])
    return at_once(planned(course, front)) if course else None


def _set_out(course: Course, front: Front) -> tuple[float, float]:
    """Where, and how fast, the run is whose moving average is at a front."""
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
    samples = course.samples(x)
    yield
    found, limits = course.at(samples)
    yield
    velocity, acceleration, jerk = (np.ascontiguousarray(limits[:, i]) for i in range(3))
    squares, speeds, times = (np.empty(len(samples)) for _ in range(3))
    caps(found, velocity, acceleration, jerk, squares)
    run(samples, found, acceleration, squares, 0.0, speed, speeds, times)
    yield
    widths = _widths(course, samples, times, front)
    if widths.min() < SHORTEST_S:
        return None
    yield
    mean = np.empty((len(widths) + 1, 3))
    moving_average(
        np.append(earlier[0], samples),
        np.append(earlier[1], speeds),
        np.append(-window_s, times),
        np.empty(len(samples) + 1),
        window_s,
        np.append(0.0, np.cumsum(widths)),
        mean,
    )
    return _controls(front, mean, widths, course.end_x), widths


def _straight(course: Course) -> tuple[Array, Array]:
    """The same for a move along a straight line of the joints: its fastest motion."""
    rates = np.abs(course.at(np.zeros(1))[0][0, 1])
    task = InputParameter(1)
    task.target_position = [course.end_x]
    velocity, acceleration, jerk = (
        float((limit / np.maximum(rates, STILL)).min()) for limit in course.moves[0].limits
    )
    task.max_velocity, task.max_acceleration, task.max_jerk = [velocity], [acceleration], [jerk]
    fastest_way = Trajectory(1)
    if Ruckig(1).calculate(task, fastest_way) != Result.Working:
        raise ArithmeticError("Ruckig: no way from rest to rest")
    end_s = fastest_way.duration
    widths = _widths_between(end_s, [], np.empty(0))
    mean = np.array(
        [[each[0] for each in fastest_way.at_time(t)] for t in np.append(0.0, np.cumsum(widths)).tolist()]
    )
    return _controls(Front.at_start(), mean, widths, course.end_x), widths


def _controls(front: Front, mean: Array, widths: Array, end_x: float) -> Array:
    """A B-spline that has these values and derivatives over nominal time (N + 1, 3) at knots."""
    first = len(front.times) - 1
    controls = np.empty(first + len(mean) + 2)
    controls[: first + 3] = front.controls
    # The control point of the knot k is k + 1: its value without a sixth of its second derivative over theta.
    inner, (before, behind) = mean[2:-1], (widths[1:-1], widths[2:])
    second = inner[:, 2] * (0.5 * (before + behind)) ** 2 + inner[:, 1] * (behind - before)
    controls[first + 3 : -2] = inner[:, 0] - second / 6.0
    controls[-3:] = end_x
    return controls


def _checked(nominal: tuple[Array, Array] | None) -> tuple[Array, Array]:
    assert nominal is not None
    return nominal


def _widths(course: Course, samples: Array, times: Array, front: Front) -> Array:
    """Nominal times of cells behind the front: some more at short corners, fewer far from any, changing
    gently."""
    window_s = course.window_s
    first, last = course.corner_spans()
    enter = np.interp(first, samples, times) + 0.5 * window_s
    leave = np.interp(last, samples, times) + 0.5 * window_s
    corners = [(a, b) for a, b in zip(enter.tolist(), leave.tolist(), strict=True) if b > 0.0]
    return _widths_between(float(times[-1]) + window_s, corners, front.cells_s)


def _widths_between(end_s: float, corners: list[tuple[float, float]], first: Array) -> Array:
    """The same from 0 on, with corners from when to when, beginning with such widths."""
    begins, ends = [0.0, *(b for _, b in corners)], [*(a for a, _ in corners), end_s]
    grid = np.concatenate([_grid(a, b) for a, b in zip(begins, ends, strict=True)])
    cell_s = min(CELL_S, end_s / LEAST_CELLS)
    density = np.full(len(grid), 1.0 / cell_s)
    for a, b in zip(begins, ends, strict=True):
        if b - a > 4.0 * NEAR_S:
            between = (grid > a) & (grid < b)
            far = np.maximum((grid[between] - a) * (b - grid[between]) / (b - a) - NEAR_S, 0.0)
            density[between] = 1.0 / (cell_s + WIDER * far * far / (far + NEAR_S))
    if corners:
        for a, b in corners:
            low, high = grid.searchsorted((a - BESIDE_S, b + BESIDE_S)).tolist()
            wish = 1.0 / max((b - a) / CORNER_CELLS, SHORTEST_CELL_S)
            np.maximum(density[low:high], wish, out=density[low:high])
        for _ in range(2):
            sums = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(grid))])
            around = np.clip([grid - 0.5 * BESIDE_S, grid + 0.5 * BESIDE_S], 0.0, end_s)
            density = (np.interp(around[1], grid, sums) - np.interp(around[0], grid, sums)) / (
                around[1] - around[0]
            )
    theta = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(grid))])
    count = max(4 * round(0.25 * float(theta[-1])), LEAST_CELLS)
    widths: Array = np.diff(np.interp(np.linspace(0.0, float(theta[-1]), count + 1), theta, grid))
    for _ in range(2):
        widths = np.convolve(np.concatenate([widths[2:0:-1], widths, widths[-2:-4:-1]]), SMOOTH, "valid")
    fade = np.zeros(count)
    if len(first):
        k = np.arange(count)
        off = (first / widths[: len(first)] - 1.0).tolist()
        grow = off[1] * GROW - off[0] if len(off) > 1 else 0.0
        fade = np.exp(-k / SEAM)
        widths *= np.maximum(1.0 + (off[0] + grow * k) * fade, LEAST_PART)
    widths *= 1.0 + (end_s - widths.sum()) / float((widths * (1.0 - fade)).sum()) * (1.0 - fade)
    return widths


def _grid(start_s: float, end_s: float) -> Array:
    """Times from one to another, close to each other near either end."""
    way_s = end_s - start_s
    if way_s < 8.0 * NEAR_S:
        return np.linspace(start_s, end_s, max(int(way_s * GRID_PER_S), 2 * LEAST_CELLS))
    near = np.linspace(0.0, 2.0 * NEAR_S, int(2.0 * NEAR_S * GRID_PER_S), endpoint=False)
    half = np.concatenate([near, np.geomspace(2.0 * NEAR_S, 0.5 * way_s, 200)])
    return np.concatenate([start_s + half, (end_s - half[::-1])[1:]])
