"""Draws a motion: joints, TCP and forces over time, and the path of the TCP.

The module avoids pyplot and its global state, and writes no date and no random names: the same motion gives
the same bytes.
"""

import warnings
from collections.abc import Sequence
from io import BytesIO
from math import dist
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from iiwa_sim.plot.motion import Array, Motion
from iiwa_sim.wording import harmless, shortened

FORMATS = ("png", "svg")
MOST_NUMBERS = 40
"""Most moves that are drawn with numbers and listed."""

_WIDTH_IN, _PANEL_IN = 12.0, 2.0
_STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.edgecolor": "#888888",
    "grid.color": "#e4e4e4",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "path.simplify_threshold": 0.3,
    "savefig.dpi": 110.0,
    "svg.hashsalt": "iiwa-sim",
}
# Colours of Okabe and Ito, which colour-blind readers can tell apart; without yellow.
_COLOURS = ("#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7")
_OF_AXES = (_COLOURS[4], _COLOURS[3], _COLOURS[5])
_RED = "#c92a2a"
_NUMBER: dict[str, Any] = {
    "fontsize": 8.5,
    "fontweight": "bold",
    "path_effects": [withStroke(linewidth=2.5, foreground="white")],
    "textcoords": "offset points",
}
_BESIDE: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "handlelength": 1.2}
_LAYOUT_DIGITS = 6  # fraction of the figure; further digits vary between runs
_LONGEST_NAME = 60
_CLOSEST = 0.03  # part of the panel: numbers nearer to each other share a label
_SMALLEST_MM = 1.0  # margin round the path: a TCP at rest has no extent of its own
_NO_TRACES: dict[str, dict[str, str | None]] = {"png": {"Software": None}, "svg": {"Date": None}}


def picture(motion: Motion, file_format: str) -> bytes:
    """Return the picture as the bytes of a file in one of the FORMATS."""
    with matplotlib.style.context(_STYLE, after_reset=True), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # in the name of a user's file
        file, figure = BytesIO(), draw(motion)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for axes in figure.axes:
            axes.set_position(Bbox(axes.get_position().get_points().round(_LAYOUT_DIGITS)))
        figure.savefig(file, format=file_format, metadata=_NO_TRACES[file_format])
        return file.getvalue()


def draw(motion: Motion) -> Figure:
    """Return the figure: panels over time on the left; on the right the path of the TCP and its moves."""
    rows = 5 if motion.force_n.any() else 4
    figure = Figure(figsize=(_WIDTH_IN, rows * _PANEL_IN), layout="constrained")
    figure.suptitle(_title(motion), parse_math=False, fontsize=10.5)
    grid = figure.add_gridspec(rows, 2, width_ratios=[1.5, 1.0])
    robot, times_s = motion.description, motion.times_s
    panels = _panels(figure, grid, rows)
    positions, velocities, places, speed = panels[:4]
    positions.set_ylabel("joints (deg)")
    velocities.set_ylabel("joint velocities\n(% of limits)")
    for joint, name in enumerate(robot.joints):
        colour = _COLOURS[joint % len(_COLOURS)]
        positions.plot(times_s, np.degrees(motion.joints[:, joint]), color=colour, label=name)
        percent = 100.0 * motion.velocity[:, joint] / robot.velocity[joint]
        velocities.plot(times_s, percent, color=colour)
    for text in positions.legend(**_BESIDE).get_texts():
        text.set_parse_math(False)
    places.set_ylabel("TCP (mm)")
    speed.set_ylabel("TCP speed (mm/s)")
    speed.plot(times_s, motion.tcp_speed_mm_s(), color=_OF_AXES[0])
    _draw_axes(places, times_s, motion.tcp_mm)
    if rows == 5:
        panels[4].set_ylabel("force at the TCP (N)")
        _draw_axes(panels[4], times_s, motion.force_n)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0.0, max(float(times_s[-1]), 1e-9))
    figure.align_ylabels(panels)
    _mark_times(panels, motion)
    beside = grid[:, 1].subgridspec(2, 1, height_ratios=[2.5, 1.0])
    _draw_path(figure.add_subplot(beside[0]), motion)
    _list_moves(figure.add_subplot(beside[1]), motion)
    return figure


def _title(motion: Motion) -> str:
    names = [
        shortened(harmless(each), _LONGEST_NAME) for each in (Path(motion.path).name, motion.description.name)
    ]
    return f"{names[0]} on {names[1]}: {motion.times_s[-1]:.2f} s"


def _panels(figure: Figure, grid: GridSpec, rows: int) -> list[Axes]:
    first = figure.add_subplot(grid[0, 0])
    panels = [first, *(figure.add_subplot(grid[row, 0], sharex=first) for row in range(1, rows))]
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    return panels


def _draw_axes(panel: Axes, times_s: Array, values: Array) -> None:
    for axis, name in enumerate("xyz"):
        panel.plot(times_s, values[:, axis], color=_OF_AXES[axis], label=name)
    panel.legend(**_BESIDE)


def _numbered(motion: Motion) -> list[tuple[str, int]]:
    """Return numbers and indices of the moves that have numbers: none if there are too many."""
    found = [index for index, move in enumerate(motion.moves) if not move.streamed]
    return (
        [(str(number), index) for number, index in enumerate(found, 1)] if len(found) <= MOST_NUMBERS else []
    )


def _mark_times(panels: list[Axes], motion: Motion) -> None:
    """Mark the ends of moves, and the beginning of the error state with its code."""
    ended = [
        ((move.end_s / max(float(motion.times_s[-1]), 1e-9), 0.0), number)
        for number, index in _numbered(motion)
        if (move := motion.moves[index]).end_s is not None
    ]
    transform = panels[0].get_xaxis_transform()
    for (share, _), label in together(ended):
        time_s = share * float(motion.times_s[-1])
        for panel in panels:
            panel.axvline(time_s, color="#999999", linestyle=":", linewidth=1.0, zorder=1.0)
        panels[0].annotate(label, (time_s, 1.0), (0.0, 3.0), xycoords=transform, ha="center", **_NUMBER)
    for time_s, code in motion.faults:
        for panel in panels:
            panel.axvline(time_s, color=_RED, linewidth=1.2, zorder=1.5)
        text = f"error {code}"
        panels[0].annotate(text, (time_s, 1.0), (3.0, -10.0), xycoords=transform, color=_RED, **_NUMBER)


def _draw_path(view: Axes, motion: Motion) -> None:
    """Draw the path of the TCP to scale, seen along the axis of the base along which it extends least."""
    least = int(np.ptp(motion.tcp_mm, axis=0).argmin())
    first, second = [axis for axis in range(3) if axis != least]
    path = motion.tcp_mm[:, [first, second]]
    view.set_title(f"TCP in the {'xyz'[first]}{'xyz'[second]} plane", fontsize=9.0)
    view.plot(*path.T, color=_OF_AXES[0], label="TCP")
    view.plot(*path[0], color=_OF_AXES[0], marker="o", markerfacecolor="white", linestyle="", label="start")
    goals = np.array([(move.goal_mm[first], move.goal_mm[second]) for move in motion.moves]).reshape(-1, 2)
    for goal, move in zip(goals, motion.moves, strict=True):
        if move.blending_mm:
            view.add_patch(Circle(tuple(goal), move.blending_mm, color=_COLOURS[1], alpha=0.2, linewidth=0.0))
    if len(goals):
        view.plot(*goals.T, color=_OF_AXES[2], marker="+", linestyle="", label="target")
    extent_mm = float(np.ptp(path, axis=0).max()) + _SMALLEST_MM
    places = [(tuple(goals[index] / extent_mm), number) for number, index in _numbered(motion)]
    for place, label in together(places):
        view.annotate(label, tuple(extent_mm * np.array(place)), (5.0, 5.0), **_NUMBER)
    view.update_datalim([path.min(axis=0) - _SMALLEST_MM, path.max(axis=0) + _SMALLEST_MM])
    view.ticklabel_format(useOffset=False)
    view.set_aspect("equal", adjustable="datalim")
    view.set_xlabel(f"{'xyz'[first]} (mm)")
    view.set_ylabel(f"{'xyz'[second]} (mm)")
    view.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)


def _list_moves(beside: Axes, motion: Motion) -> None:
    """List the moves that have numbers, in two columns if there are many."""
    beside.set_axis_off()
    names = [f"{number} {motion.moves[index].name}".rstrip() for number, index in _numbered(motion)]
    rows = max(-(-len(names) // 2), 10)
    for column, start in enumerate(range(0, len(names), rows)):
        text = "\n".join(names[start : start + rows])
        beside.text(0.5 * column, 1.0, text, va="top", fontsize=7.5, parse_math=False)


def together(numbered: Sequence[tuple[tuple[float, ...], str]]) -> list[tuple[tuple[float, ...], str]]:
    """Merge the numbers of places closer than `_CLOSEST` into one label at the first of them."""
    groups: list[tuple[tuple[float, ...], list[str]]] = []
    for place, number in numbered:
        for first, others in groups:
            if dist(first, place) < _CLOSEST:
                others.append(number)
                break
        else:
            groups.append((place, [number]))
    return [
        (place, ", ".join(each if len(each) < 5 else [*each[:3], "...", each[-1]])) for place, each in groups
    ]
