"""Draws a motion: joints, TCP and forces over time, and the path of the TCP.

The module avoids pyplot and its global state.
"""

import warnings
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from iiwa_sim.plot.motion import Array, Motion
from iiwa_sim.wording import harmless, shortened

MOST_NUMBERS, ROWS = 40, 20
"""Most moves that are drawn with numbers and listed, and rows of the list."""

_WIDTH_IN, _PANEL_IN = 12.0, 2.0
_STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "savefig.dpi": 110.0,
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
_LONGEST_NAME = 60
_SMALLEST_MM = 1.0  # margin round the path: a TCP at rest has no extent of its own


def picture(motion: Motion, file_format: str) -> bytes:
    """Return the picture as the bytes of a PNG or SVG file."""
    with matplotlib.style.context(_STYLE, after_reset=True), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # in the name of a user's file
        file = BytesIO()
        draw(motion).savefig(file, format=file_format)
        return file.getvalue()


def draw(motion: Motion) -> Figure:
    """Return the figure: panels over time on the left; on the right the path of the TCP and its moves."""
    robot, times_s = motion.description, motion.times_s
    rows = 5 if motion.force_n.any() else 4
    figure = Figure(figsize=(_WIDTH_IN, rows * _PANEL_IN), layout="constrained")
    names = [shortened(harmless(name), _LONGEST_NAME) for name in (Path(motion.path).name, robot.name)]
    figure.suptitle(f"{' on '.join(names)}: {times_s[-1]:.2f} s", parse_math=False, fontsize=10.5)
    left, right = figure.subfigures(1, 2, width_ratios=[1.5, 1.0], squeeze=False)[0]
    panels = list(left.subplots(rows, sharex=True))
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
    distance_mm = np.linalg.norm(np.diff(motion.tcp_mm, axis=0, prepend=motion.tcp_mm[:1]), axis=1)
    speed.plot(times_s, distance_mm / np.diff(times_s, prepend=-1.0), color=_OF_AXES[0])
    _draw_axes(places, times_s, motion.tcp_mm)
    if rows == 5:
        panels[4].set_ylabel("force at the TCP (N)")
        _draw_axes(panels[4], times_s, motion.force_n)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0.0, max(float(times_s[-1]), 1e-9))
    left.align_ylabels(panels)
    _mark_times(panels, motion)
    path, moves = right.subplots(2, height_ratios=[2.5, 1.0])
    _draw_path(path, motion)
    moves.set_axis_off()
    names = [f"{number} {motion.moves[index].name}".rstrip() for number, index in _numbered(motion)]
    for column, start in enumerate(range(0, len(names), ROWS)):
        text = "\n".join(names[start : start + ROWS])
        moves.text(0.5 * column, 1.0, text, va="top", fontsize=7.5, parse_math=False)
    return figure


def _draw_axes(panel: Axes, times_s: Array, values: Array) -> None:
    for axis, name in enumerate("xyz"):
        panel.plot(times_s, values[:, axis], color=_OF_AXES[axis], label=name)
    panel.legend(**_BESIDE)


def _numbered(motion: Motion) -> list[tuple[str, int]]:
    """Return numbers and indices of the moves that have numbers: none if there are too many."""
    found = [index for index, move in enumerate(motion.moves) if not move.streamed]
    return [(str(n), index) for n, index in enumerate(found, 1)] if len(found) <= MOST_NUMBERS else []


def _mark_times(panels: list[Axes], motion: Motion) -> None:
    """Mark the ends of moves, and the beginning of the error state with its code."""
    transform = panels[0].get_xaxis_transform()
    ends = [(motion.moves[index].end_s, number) for number, index in _numbered(motion)]
    marks = [(time_s, number, "#999999", 3.0) for time_s, number in ends if time_s is not None]
    marks += [(time_s, f"error {code}", _RED, -10.0) for time_s, code in motion.faults]
    for time_s, text, colour, above in marks:
        for panel in panels:
            panel.axvline(time_s, color=colour, linewidth=1.0, zorder=1.0)
        panels[0].annotate(text, (time_s, 1.0), (0.0, above), xycoords=transform, color=colour, **_NUMBER)


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
    for number, index in _numbered(motion):
        view.annotate(number, tuple(goals[index]), (5.0, 5.0), **_NUMBER)
    view.update_datalim([path.min(axis=0) - _SMALLEST_MM, path.max(axis=0) + _SMALLEST_MM])
    view.ticklabel_format(useOffset=False)
    view.set_aspect("equal", adjustable="datalim")
    view.set_xlabel(f"{'xyz'[first]} (mm)")
    view.set_ylabel(f"{'xyz'[second]} (mm)")
    view.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
