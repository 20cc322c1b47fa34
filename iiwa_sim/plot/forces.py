"""The forces at the TCP over time, and the thresholds of force moves.

A threshold is a band round the force at the command, for as long as the move was guarded: a force that leaves
the band of its own colour ends the move.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from iiwa_sim.controller.force_guard import AXES
from iiwa_sim.plot.marks import COLOURS
from iiwa_sim.plot.record import Recording

_COLOURS = (COLOURS[4], COLOURS[3], COLOURS[5])
_EDGE: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.9}
_BAND_ALPHA = 0.13
_ENDED: dict[str, Any] = {"marker": "x", "markersize": 7.0, "markeredgewidth": 1.8, "linestyle": ""}
_LEGEND: dict[str, Any] = {"loc": "center left", "frameon": False, "fontsize": 8.0, "handlelength": 1.4}
_ROOM = 0.12  # of the height, above and below the visible values
_MOST = 2.0  # bands wider than this multiple of the largest force leave the picture
_LEAST_N = 1e-3
_MOST_N = 1e9  # limits for values that are drawn, which have to be finite


def draw_forces(panel: Axes, recording: Recording) -> None:
    """Fill a panel."""
    panel.set_ylabel("force at the TCP (N)")
    times_s = recording.times_s()
    for axis, name in enumerate(AXES):
        panel.plot(times_s, recording.force_n[:, axis], color=_COLOURS[axis], label=f"along {name}")
    low_n, high_n = _range(recording)
    panel.set_ylim(low_n, high_n)
    for axis in range(len(AXES)):
        _draw_bands(panel, recording, axis, (2.0 * low_n - high_n, 2.0 * high_n - low_n))
        _draw_ends(panel, recording, axis)
    if any(watch.ticks for watch in recording.watches):
        panel.fill_between([], [], color="#555555", alpha=_BAND_ALPHA, label="threshold")
    if any(watch.contact for watch in recording.watches):
        panel.plot([], [], color="#555555", label="ends a move", **_ENDED)


def draw_legend(beside: Axes, panel: Axes) -> None:
    """Fill the axes beside a panel of forces."""
    beside.set_axis_off()
    beside.legend(*panel.get_legend_handles_labels(), **_LEGEND)


def _draw_bands(panel: Axes, recording: Recording, axis: int, seen_n: tuple[float, float]) -> None:
    """Draw the bands round the force along an axis, cut off outside the visible range."""
    low, high = np.full((2, len(recording.joints)), np.nan)
    for watch in recording.watches:
        threshold, offset = watch.thresholds_n[axis], watch.offset_n[axis]
        if watch.ticks is not None and threshold is not None:
            first, last = watch.ticks
            watched = slice(first - 1, last + 1)  # a tick is the interval that ends with its sample
            low[watched], high[watched] = np.clip([offset - threshold, offset + threshold], *seen_n)
    times_s, colour = recording.times_s(), _COLOURS[axis]
    if not np.isnan(low).all():
        panel.fill_between(times_s, low, high, color=colour, alpha=_BAND_ALPHA, linewidth=0.0)
        panel.plot(times_s, low, color=colour, **_EDGE)
        panel.plot(times_s, high, color=colour, **_EDGE)


def _draw_ends(panel: Axes, recording: Recording, axis: int) -> None:
    """Mark the forces that have left their band."""
    ended = [
        (watch.ticks[1] * recording.tick_s, watch.contact.force_n)
        for watch in recording.watches
        if watch.ticks is not None and watch.contact is not None and watch.contact.axis == AXES[axis]
    ]
    if ended:
        around = [withStroke(linewidth=3.5, foreground="white")]
        times_s, forces_n = zip(*ended, strict=True)
        panel.plot(times_s, forces_n, color=_COLOURS[axis], path_effects=around, zorder=3.0, **_ENDED)


def _range(recording: Recording) -> tuple[float, float]:
    """Range of the forces, and of the bands as far as they fit."""
    felt = recording.force_n
    seen = [float(felt.min()), float(felt.max())]
    widest_n = _MOST * max(seen[1] - seen[0], abs(seen[0]), abs(seen[1]))
    bands = [
        (offset - threshold, offset + threshold)
        for watch in recording.watches
        for offset, threshold in zip(watch.offset_n, watch.thresholds_n, strict=True)
        if threshold is not None and watch.ticks is not None
    ]
    if bands and not widest_n:  # no force at all: show some band
        widest_n = min(high - low for low, high in bands)
    seen += [edge for low, high in bands if high - low <= widest_n for edge in (low, high)]
    low_n, high_n = max(min(seen), -_MOST_N), min(max(seen), _MOST_N)
    room_n = max(_ROOM * (high_n - low_n), _LEAST_N)
    return low_n - room_n, high_n + room_n
