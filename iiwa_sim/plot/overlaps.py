"""Which curves of a panel lie on others: they are dashed, so that those below show in the gaps."""

import numpy as np

from iiwa_sim.plot.record import Array

_NEAR = 0.008  # part of the panel's height: less than a line is thick
_LEAST = 0.5  # part of the time in which anything moves: a curve that is hidden for longer is hardly seen

_DASHES: tuple[tuple[float, float], ...] = ((6.0, 6.0), (3.0, 9.0), (1.5, 10.5))
"""Dashes, on and off, by how many curves lie below: the more, the shorter."""


def dashes(values: Array, height: float) -> list[tuple[float, tuple[float, float]] | str]:
    """The line style of each curve. `values` (samples, curves) are drawn in their order.

    A curve is dashed if it hides another for most of the time. Samples in which all curves are at one place,
    as velocities are at rest, are not counted. `height` is that of the panel.
    """
    near = _NEAR * height
    counted = np.ptp(values, axis=1) > near
    least = max(_LEAST * int(counted.sum()), 1.0)
    found: list[tuple[float, tuple[float, float]] | str] = []
    for curve in range(values.shape[1]):
        here = values[counted, curve, None]
        below = int((np.sum(np.abs(values[counted, :curve] - here) <= near, axis=0) >= least).sum())
        found.append((0.0, _DASHES[min(below, len(_DASHES)) - 1]) if below else "-")
    return found
