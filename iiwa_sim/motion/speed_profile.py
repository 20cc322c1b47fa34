"""From a blended path to its speed profile: the nominal motion, its segments, and the fastest profile.

The nominal motion is the moving average of the fastest run without jerk limits, as a cubic B-spline x(theta)
over segments. The profile (`plan_kernel.SpeedProfile`) then keeps all limits. Work is done in slices.
"""

from collections.abc import Generator
from typing import TypeVar

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.plan_kernel import BlendedPath, SpeedProfile, run

T = TypeVar("T")
Slices = Generator[None, None, T]
"""Work in slices, as a generator: a tick, which delays commands, has room for one slice."""

WORK = 1000
"""Budget of one call of the profile, in interior-point steps of a segment: some 0.4 ms."""
ENOUGH = 0.03
"""Duality gap that ends a solution, as a part of the duration."""
MANY_SAMPLES = 400
"""A nominal motion of fewer samples of x is planned in at most two slices."""
MANY_SEGMENTS = 100
"""A trajectory of fewer segments is put together in the slice that has solved it."""
SHORTEST_SEGMENT_S = 1e-4
"""With a shorter segment hardly more is left than the kept part: it is too late to plan."""
SEGMENT_S = 0.01
EVEN_SEGMENT_S, EVEN_UP_TO_S = 0.015, 1.6
"""Segments of one move alone that takes no longer are even, which takes less to compute."""
LEAST_SEGMENTS, LEAST_LEFT = 24, 16
"""Least number of segments from rest, and behind segments that are kept."""
PACE, FASTEST, BESIDE = 0.98, 1.18, 5
"""First guess: part of an even pace, most over the nominal one, and distance of segments that count."""
BLEND_SEGMENTS, SHORTEST_S = 12, 0.0025
"""About the number of segments of a blend; least length of them."""
BESIDE_S = 0.08
"""Time over which the density of segments is averaged."""
NEAR_S, WIDER = 0.2, 0.1
"""Segments farther than that from any event are longer by at most that part of the distance."""
SWITCH = 0.1
"""A change of acceleration by more than this part of the largest one is an event."""
FADE = 0.8187307530779818  # exp(-1/5): the length of kept segments fades within some five segments
LEAST_PART = 0.2
LEAST_S, LONGEST_S = 1e-300, 1e7
_GROWING_S = 0.002 * np.concatenate([np.arange(125.0), 125.0 * 1.1 ** np.arange(190.0)])
"""Distances (s) from an event at which the density of segments is evaluated."""


def sets_out(path: BlendedPath, state: tuple[float, float, float]) -> tuple[float, float]:
    """Return x and dx/dt (1/s) of the run whose moving average is in a state (x, dx/dt, d2x/dt2)."""
    half_s = 0.5 * path.window_s
    x, speed, acceleration = state
    return x + half_s * speed + acceleration * half_s**2 / 3.0, speed + half_s * acceleration


def nominal(
    path: BlendedPath, before: Array, state: tuple[float, float, float] | None, first_s: Array
) -> Slices[tuple[Array, Array] | None]:
    """Return x as a cubic B-spline and the nominal lengths (s) of its new segments.

    Args:
        path: The blended path.
        before: Coefficients (kept + 3,) of x that stay.
        state: x, dx/dt and d2x/dt2 at the end of these; None at rest at the beginning of the path.
        first_s: Lengths (s) that the first new segments should have (0 to 2,).

    Returns:
        Coefficients (N + 3,) and lengths (N - kept,); None if it is too late to plan.
    """
    window_s = path.window_s
    x, speed, earlier = path.first_x, 0.0, (path.first_x, 0.0)
    if state is not None:
        x, speed = sets_out(path, state)
        earlier = x - window_s * state[1], state[1] - 0.5 * window_s * state[2]
        if x >= path.end_x or speed < 0.0:
            return None
    samples = path.samples(x)
    many = len(samples) > MANY_SAMPLES
    if many:
        yield
    derivatives, limits = path.derivatives(samples)
    if many:
        yield
    # The run, behind where it was a window before.
    x_run, speeds, times = np.empty((3, len(samples) + 1))
    x_run[0], speeds[0], times[0] = *earlier, -window_s
    x_run[1:] = samples
    run(samples, derivatives, limits, speed, speeds[1:], times[1:])
    if len(samples) > 0.5 * MANY_SAMPLES:
        yield
    half_s, end_s = 0.5 * window_s, float(times[-1]) + window_s
    if end_s < EVEN_UP_TO_S and len(path.moves) == 1 and not len(first_s):
        count = max(4 * round(0.25 * end_s / EVEN_SEGMENT_S), LEAST_SEGMENTS)
        lengths_s = np.full(count, end_s / count)
    else:
        begins, ends = (np.interp(span, samples, times[1:]) + half_s for span in blend_spans(path))
        events = _switches(times[1:], speeds[1:]) + half_s
        ahead = ends > 0.0
        density = segment_density(end_s, begins[ahead], ends[ahead], events, first_s)
        if many:
            yield
        lengths_s = segment_lengths(*density, end_s, first_s)
    if lengths_s.min() < SHORTEST_SEGMENT_S:
        return None
    if many:
        yield
    knots_s = np.concatenate([[0.0], lengths_s.cumsum()])
    motion = _moving_average(x_run, speeds, times, window_s, knots_s)
    return _splined(before, motion, lengths_s, path.end_x), lengths_s


def sampled(path: BlendedPath, x: Array, old: Array, kept: int) -> Slices[SpeedProfile]:
    """Return the profile, not yet solved, of a path along which x is a cubic B-spline (N + 3,).

    `old` are coefficients of the profile over the first `kept` segments; two of them stay.
    """
    profile = SpeedProfile(path, x, old, kept)
    if len(x) > MANY_SEGMENTS:
        yield
    while not profile.sample(WORK):
        yield
    return profile


def guess(profile: SpeedProfile, lengths: Array) -> None:
    """Write a first guess over the last segments, of nominal lengths (M,) in UNIT_S.

    It is the least even pace of each segment and two near it.
    """
    pace = np.minimum(PACE * profile.even_rates[-len(lengths) :] * lengths * lengths, FASTEST)
    least = np.concatenate([pace[:BESIDE], np.minimum(pace[BESIDE:], pace[:-BESIDE])])
    least[:-BESIDE] = np.minimum(least[:-BESIDE], pace[BESIDE:])
    rates = least / (lengths * lengths)
    new = np.concatenate([rates[:1], rates, rates[-1:]])
    profile.coefficients[profile.fixed - len(new) :] = new[profile.fixed :]


def fastest(profile: SpeedProfile) -> Slices[bool]:
    """Bring a profile from its first guess close to the fastest one. Return whether it keeps all limits."""
    profile.begin(ENOUGH)
    while not profile.advance(WORK):
        yield
    return bool(profile.keeps_limits)


def _moving_average(x: Array, speeds: Array, times: Array, window_s: float, at: Array) -> Array:
    """Return the mean of a run over the window before each rising time, with two derivatives (3, p).

    No window begins before the first sample; behind the last one the run rests.
    """
    steps = times[1:] - times[:-1]
    areas = steps * (x[:-1] + steps * (2.0 * speeds[:-1] + speeds[1:]) / 6.0)
    areas = np.concatenate([[0.0], areas.cumsum()])  # integral of x up to each sample
    ends = np.concatenate([at, at - window_s])
    speed = np.interp(ends, times, speeds)
    k = times.searchsorted(ends, side="right") - 1
    before, first, left = x[k], speeds[k], ends - times[k]
    area = areas[k] + left * (before + left * (2.0 * first + speed) / 6.0)
    motion = np.array([area, before + 0.5 * left * (first + speed), speed])
    mean: Array = (motion[:, : len(at)] - motion[:, len(at) :]) / window_s
    return mean


def blend_spans(path: BlendedPath) -> tuple[Array, Array]:
    """Return x at which each blend begins, and at which it ends."""
    x, blends = np.array(path.borders), np.array(path.blends).reshape(-1, 3)
    lengths = x[1:] - x[:-1]
    return x[1:-1] - blends[:, 0] * lengths[:-1], x[1:-1] + blends[:, 1] * lengths[1:]


def _switches(times: Array, speeds: Array) -> Array:
    """Return times at which the acceleration of a run, constant between samples, changes by much."""
    accelerations = (speeds[1:] - speeds[:-1]) / np.maximum(times[1:] - times[:-1], 1e-9)
    changes = np.abs(accelerations - np.concatenate([[0.0], accelerations[:-1]]))
    found: Array = times[:-1][changes > SWITCH * np.abs(accelerations).max()]
    return found


def segment_density(
    end_s: float, begins: Array, ends: Array, events: Array, first_s: Array
) -> tuple[Array, Array]:
    """Return times (m,), and at each how many segments there should be in a second.

    Segments are short in blends (k,) from `begins` to `ends`, long where nothing happens for long, and change
    gently. `events` are times of anything else. Raises ArithmeticError for times that no motion can take.
    """
    for time_s in (end_s, *first_s.tolist()):
        if not LEAST_S < time_s < LONGEST_S:
            raise ArithmeticError(f"a motion that takes {time_s} s")
    segment_s = min(SEGMENT_S, end_s / (LEAST_LEFT if len(first_s) else LEAST_SEGMENTS))
    all_events = np.concatenate([begins, ends, events])
    inner = all_events[(all_events > 0.0) & (all_events < end_s)]
    inner.sort()
    borders = np.concatenate([[0.0], inner, [end_s]])
    gaps = np.diff(borders)
    # Times at growing distances from both events of each gap.
    counts = np.searchsorted(_GROWING_S, 0.5 * gaps)
    steps = np.arange(int(counts.sum())) - np.repeat(counts.cumsum() - counts, counts)
    from_event, gap = _GROWING_S[steps], np.repeat(gaps, counts)
    t = np.repeat(borders[:-1], counts) + from_event
    t = np.concatenate([t, np.repeat(borders[1:], counts) - from_event])
    far = np.maximum(from_event * (gap - from_event) / gap - NEAR_S, 0.0)
    longer = np.where(gap > 4.0 * NEAR_S, WIDER * far * far / (far + NEAR_S), 0.0)
    density: Array = 1.0 / np.tile(segment_s + longer, 2)
    order = t.argsort(kind="stable")
    t, density = t[order], density[order]
    lows, highs = t.searchsorted(begins - BESIDE_S), t.searchsorted(ends + BESIDE_S)
    wishes = 1.0 / np.maximum((ends - begins) / BLEND_SEGMENTS, SHORTEST_S)
    for low, high, wish in zip(lows.tolist(), highs.tolist(), wishes.tolist(), strict=True):
        np.maximum(density[low:high], wish, out=density[low:high])
    for _ in range(2 if len(begins) else 0):
        whole = _integral(t, density)
        low_s, high_s = np.maximum(t - 0.5 * BESIDE_S, 0.0), np.minimum(t + 0.5 * BESIDE_S, end_s)
        density = (np.interp(high_s, t, whole) - np.interp(low_s, t, whole)) / (high_s - low_s)
    return t, density


def segment_lengths(t: Array, density: Array, end_s: float, first_s: Array) -> Array:
    """Return lengths (s) of segments of a density, the first ones like `first_s` (0 to 2,)."""
    least = LEAST_LEFT if len(first_s) else LEAST_SEGMENTS
    whole = _integral(t, density)
    count = max(4 * int(0.25 * whole[-1] + 0.5), least)
    wanted = whole[-1] * np.arange(1, count) / count
    # Between places the density is linear.
    k = np.minimum(whole.searchsorted(wanted, side="right") - 1, len(t) - 2)
    slope = np.diff(density)[k] / np.maximum(np.diff(t)[k], 1e-300)
    left = wanted - whole[k]
    root = np.sqrt(np.maximum(density[k] ** 2 + 2.0 * slope * left, 0.0))
    knots = np.concatenate([[0.0], t[k] + 2.0 * left / (density[k] + root), [end_s]])
    lengths = np.diff(knots)
    fade: Array = np.zeros(count)
    if len(first_s):
        fade = FADE ** np.arange(count, dtype=np.float64)
        off = first_s[0] / lengths[0] - 1.0
        grow = (first_s[1] / lengths[1] - 1.0) / FADE - off if len(first_s) > 1 else 0.0
        lengths *= np.maximum(1.0 + (off + grow * np.arange(count)) * fade, LEAST_PART)
    free = 1.0 - fade
    found: Array = lengths * (1.0 + (end_s - lengths.sum()) / (lengths @ free) * free)
    return found


def _integral(t: Array, values: Array) -> Array:
    """Return the integral (m,) of values that are linear between times t (m,)."""
    return np.concatenate([[0.0], (0.5 * (values[1:] + values[:-1]) * np.diff(t)).cumsum()])


def _splined(before: Array, motion: Array, lengths_s: Array, end_x: float) -> Array:
    """Return the coefficients of x as a cubic B-spline that continues those before (kept + 3,).

    `motion` (3, N + 1) is x and its first two derivatives over time at the knots. x never goes back.
    """
    # The coefficient of a knot is its value without a sixth of its second derivative over theta.
    widths, changes = 0.5 * (lengths_s[1:-2] + lengths_s[2:-1]), lengths_s[2:-1] - lengths_s[1:-2]
    x, first, second = motion[:, 2:-2]
    inner = x - (second * (widths * widths) + first * changes) / 6.0
    found: Array = np.concatenate([before, inner, np.full(3, end_x)])
    new = found[len(before) - 1 :]
    falls = new[1:] < new[:-1]
    if falls.any():
        # Segments are too long for how x changes: coefficients go between the values at the knots beside.
        means = 0.5 * (motion[0, 1:-2] + motion[0, 2:-1])
        inside = np.minimum(np.maximum(new[1:-3], means[:-1]), means[1:])
        new[1:-3] = np.where(falls[:-3] | falls[1:-2], inside, new[1:-3])
        new[1:-3] = np.minimum(np.maximum.accumulate(new[:-3])[1:], new[-1])
    return found
