"""The forces at the TCP over time, and the thresholds of force moves.

A threshold is a band round the force at the command, as long as the move was watched: a force that leaves the
band of its own colour ends the move.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from iiwa_sim.controller.force_guard import AXES
from iiwa_sim.plot.marks import COLOURS
from iiwa_sim.plot.record import Recording, Watch

_COLOURS = (COLOURS[4], COLOURS[3], COLOURS[5])
_EDGE: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.9}
_BAND_ALPHA = 0.13
_ENDED: dict[str, Any] = {"marker": "x", "markersize": 7.0, "markeredgewidth": 1.8, "linestyle": ""}
_LEGEND: dict[str, Any] = {"loc": "center left", "frameon": False, "fontsize": 8.0, "handlelength": 1.4}
_ROOM = 0.12  # of the height, above and below what has to be seen
_MOST = 2.0  # wider bands than so many times what was felt leave the picture
_LEAST_N = 1e-3
_MOST_N = 1e9  # whatever is commanded and felt: what is drawn has to be finite


def draw_forces(panel: Axes, beside: Axes, recording: Recording) -> None:
    """Fill a panel, and what is beside it with the legend."""
    panel.set_ylabel("force at the TCP (N)")
    times_s = recording.times_s()
    for axis, name in enumerate(AXES):
        panel.plot(times_s, recording.force_n[:, axis], color=_COLOURS[axis], label=f"along {name}")
    low_n, high_n = _range(recording)
    panel.set_ylim(low_n, high_n)
    for watch in recording.watches:
        _draw_watch(panel, recording, watch, (2.0 * low_n - high_n, 2.0 * high_n - low_n))
    if any(watch.ticks for watch in recording.watches):
        panel.fill_between([], [], color="#555555", alpha=_BAND_ALPHA, label="threshold")
    if any(watch.contact for watch in recording.watches):
        panel.plot([], [], color="#555555", label="ends a move", **_ENDED)
    beside.set_axis_off()
    beside.legend(*panel.get_legend_handles_labels(), **_LEGEND)


def _draw_watch(panel: Axes, recording: Recording, watch: Watch, seen_n: tuple[float, float]) -> None:
    """Bands, cut off where nobody sees them, and what has left one."""
    if watch.ticks is None:
        return
    first, last = watch.ticks
    time_s = [(first - 1) * recording.tick_s, last * recording.tick_s]  # a tick is the time before it
    for axis, threshold in enumerate(watch.thresholds_n):
        if threshold is None:
            continue
        offset, colour = watch.offset_n[axis], _COLOURS[axis]
        low, high = np.clip([offset - threshold, offset + threshold], *seen_n)
        panel.fill_between(time_s, low, high, color=colour, alpha=_BAND_ALPHA, linewidth=0.0)
        for edge in (low, high):
            panel.plot(time_s, [edge, edge], color=colour, **_EDGE)
    if watch.contact is not None:
        colour = _COLOURS[AXES.index(watch.contact.axis)]
        around = [withStroke(linewidth=3.5, foreground="white")]
        panel.plot(time_s[1], watch.contact.force_n, color=colour, path_effects=around, zorder=3.0, **_ENDED)


def _range(recording: Recording) -> tuple[float, float]:
    """Of the forces, and of the bands round them as far as they fit beside these."""
    felt = recording.force_n
    seen = [float(felt.min()), float(felt.max())]
    widest_n = _MOST * max(seen[1] - seen[0], abs(seen[0]), abs(seen[1]))
    bands = [
        (offset - threshold, offset + threshold)
        for watch in recording.watches
        for offset, threshold in zip(watch.offset_n, watch.thresholds_n, strict=True)
        if threshold is not None and watch.ticks is not None
    ]
    if bands and not widest_n:  # nothing was felt: so that some band is seen
        widest_n = min(high - low for low, high in bands)
    seen += [edge for low, high in bands if high - low <= widest_n for edge in (low, high)]
    low_n, high_n = max(min(seen), -_MOST_N), min(max(seen), _MOST_N)
    room_n = max(_ROOM * (high_n - low_n), _LEAST_N)
    return low_n - room_n, high_n + room_n
