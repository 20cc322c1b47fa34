"""How fast a path can be run within its bounds: stretches of constant acceleration, without limits of jerk.

Backwards from rest at the end with full braking, then forwards from the start with full acceleration, as in
all methods of this family. Between two samples both curves and the cap go straight in b = (ds/dt)^2; where
they cross, the profile gets a knot of its own, and where it goes from accelerating to braking it is cut off
so low that it stays level for a while.
"""

import math

import numpy as np

from iiwa_sim.motion.bounds import Bounds

LEVELS = 4  # the bounds on dds are tabulated at this many steps of b between rest and its cap
LEVEL_PARTS = np.arange(LEVELS + 1) / LEVELS
TINY = 1e-9
START_TOO_FAST = 1.02  # times the most b from which the end can be reached
SAME = 1e-15  # knots that are closer are one
CROSSING = 1e-6  # of a step: crossings closer to a sample are taken to be there


class Profile:
    """Knots of a motion along a path: rising s, and the speeds ds/dt there."""

    def __init__(self, bounds: Bounds) -> None:
        """From what the bounds allow with their present shares."""
        cap = np.minimum(bounds.velocity_cap, bounds.curve_cap * bounds.share)
        bent = bounds.bend[:, :, None] * (cap[:, None] * LEVEL_PARTS)
        room = (bounds.room * bounds.share)[:, :, None]
        # The most that b may gain forwards, and backwards, per unit of s / 2: by direction, sample and level.
        bound = np.empty((2, len(cap), LEVELS + 1))
        (room + bent).min(axis=0, out=bound[0])
        (room - bent).min(axis=0, out=bound[1])
        grow = np.zeros((2, len(cap), 1))
        grow[0, :-1, 0] = grow[1, 1:, 0] = 2.0 * np.diff(bounds.s)
        slope = (bound[:, :, 1:] - bound[:, :, :-1]) * (LEVELS / cap)[:, None]
        start = bound[:, :, :-1] - slope * (cap[:, None] * LEVEL_PARTS[:-1])
        # A step takes b to constant + factor * b, with its own two numbers for each level.
        constant = (grow * start).reshape(2, -1).tolist()
        factor = (1.0 + grow * slope).reshape(2, -1).tolist()
        self._forwards = constant[0], factor[0]
        self._backwards = constant[1], factor[1]
        self._to_level: list[float] = (LEVELS * (1.0 - TINY) / cap).tolist()
        self._caps: list[float] = cap.tolist()
        self._s: list[float] = bounds.s.tolist()
        n = len(bounds.room)
        # The jerk of the joint nearest to its limit, as a part of it, that one of s makes.
        self._jerks: list[float] = np.abs(bounds.loads[3 * n : 4 * n]).max(axis=0).tolist()

    def fastest(self, start_speed: float, window_s: float) -> tuple[list[float], list[float]] | None:
        """Knots from a speed at the first sample to rest at the last, or None where that is too fast.

        Where it would go over from accelerating to braking with too much jerk, if that took `window_s`, it
        stays level for so long.
        """
        caps, to_level, s = self._caps, self._to_level, self._s
        last = len(s) - 1
        # Backwards: the most from which the end can be reached, and what it would be without caps.
        constant, factor = self._backwards
        highest, reaches = caps.copy(), caps.copy()
        x = 0.0
        highest[last] = 0.0
        for i in range(last, 0, -1):
            row = LEVELS * i + int(x * to_level[i])
            x = constant[row] + factor[row] * x
            reaches[i - 1] = x
            if x < highest[i - 1]:
                highest[i - 1] = x = max(x, 0.0)
            else:
                x = highest[i - 1]
        x = start_speed * start_speed
        if x > highest[0]:
            if x > highest[0] * START_TOO_FAST:
                return None
            highest[0] = x
        constant, factor = self._forwards
        knots, squares = [s[0]], [x]
        for i in range(last):
            here = x
            row = LEVELS * i + min(int(here * to_level[i]), LEVELS - 1)
            reach = constant[row] + factor[row] * here
            x = highest[i + 1]
            if reach <= x:
                x = max(reach, 0.0)
            elif reaches[i] > here:
                # Accelerating would reach more, and braking would do from more: the profile has a corner.
                up, down = reach - here, reaches[i] - x
                part = (x + down - here) / (up + down)
                level = caps[i] + part * (caps[i + 1] - caps[i])
                width = s[i + 1] - s[i]
                if here + part * up <= level:
                    if CROSSING < part < 1.0 - CROSSING:
                        knots.append(s[i] + part * width)
                        squares.append(here + part * up)
                else:
                    tilt = caps[i + 1] - caps[i]
                    first = (caps[i] - here) / (up - tilt)
                    second = (x + down - caps[i]) / (tilt + down)
                    if first > CROSSING:
                        knots.append(s[i] + first * width)
                        squares.append(here + first * up)
                    if second < 1.0 - CROSSING and second > first + CROSSING:
                        knots.append(s[i] + second * width)
                        squares.append(caps[i] + second * tilt)
            knots.append(s[i + 1])
            squares.append(x)
        return self._levelled(knots, squares, window_s)

    def _levelled(self, s: list[float], b: list[float], window_s: float) -> tuple[list[float], list[float]]:
        """The same with its peaks cut off; gives speeds for their squares."""
        knots, speeds = [s[0]], [math.sqrt(b[0])]
        k, last, step = 1, len(s) - 1, 0
        while k <= last:
            top = b[k]
            if k < last and b[k - 1] < top > b[k + 1]:
                swing = (top - b[k - 1]) / (s[k] - s[k - 1]) + (top - b[k + 1]) / (s[k + 1] - s[k])
                while self._s[step + 1] < s[k]:
                    step += 1
                if swing * self._jerks[step] > 2.0 * window_s:
                    left, right, level, after = _cut(s, b, k, window_s)
                    while knots and knots[-1] >= left and len(knots) > 1:
                        knots.pop()
                        speeds.pop()
                    speed = math.sqrt(level)
                    for end in left, right:
                        if end > knots[-1] + SAME:
                            knots.append(end)
                            speeds.append(speed)
                    k = after
                    while k <= last and s[k] <= knots[-1] + SAME:
                        k += 1
                    continue
            knots.append(s[k])
            speeds.append(math.sqrt(top))
            k += 1
        return knots, speeds


def _cut(s: list[float], b: list[float], peak: int, window_s: float) -> tuple[float, float, float, int]:
    """A peak of b (by its index) cut off: from where to where, at which b, and the first index after it.

    So low that it takes `window_s`, or as low as the next dip.
    """
    left = right = peak
    top, width = b[peak], 0.0
    last = len(s) - 1
    while True:
        # In a band down to the next knot on either side, the width grows straight with depth.
        if left == 0 or right == last or b[left - 1] > top or b[right + 1] > top:
            break
        below = max(b[left - 1], b[right + 1])
        grows = 0.0
        for outer, inner in ((left - 1, left), (right + 1, right)):
            if b[inner] > b[outer]:
                grows += abs(s[inner] - s[outer]) / (b[inner] - b[outer])
        deeper = width + grows * (top - below)
        if grows > 0.0 and deeper >= window_s * math.sqrt(below):
            # width + grows (top - y^2) = window y
            speed = (math.sqrt(window_s**2 + 4.0 * grows * (width + grows * top)) - window_s) / (2.0 * grows)
            top = min(max(speed * speed, below), top)
            break
        width, top = deeper, below
        if b[left - 1] >= top:
            left -= 1
        if b[right + 1] >= top:
            right += 1
    return _place(s, b, left, left - 1, top), _place(s, b, right, right + 1, top), top, right + 1


def _place(s: list[float], b: list[float], inner: int, outer: int, level: float) -> float:
    """Where the profile has a level between two knots, the inner of which is not below it."""
    if not 0 <= outer < len(b) or b[inner] <= level or b[outer] >= b[inner]:
        return s[inner]
    return s[inner] + (s[outer] - s[inner]) * (b[inner] - level) / (b[inner] - b[outer])
