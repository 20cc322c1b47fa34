"""Draws a motion: joints, speed and force of the TCP over time, and the path of the TCP.

The module avoids pyplot and its global state.
"""

import warnings
from io import BytesIO
from typing import Any

import matplotlib.style
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from iiwa_sim.plot.motion import Motion, Move

MOST_NAMES = 40
"""Most moves that are drawn with their ends and names."""
FASTEST_MM_S = 1e4
"""A TCP that is faster was put elsewhere by the backdoor."""
_GREY, _RED = "#999999", "#c92a2a"
_STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    # Colours of Okabe and Ito, which colour-blind readers can tell apart; without yellow.
    "axes.prop_cycle": cycler(
        color=("#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#cc79a7", "#000000")
    ),
    "grid.color": "#e4e4e4",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "savefig.dpi": 110.0,
    "text.parse_math": False,
}


def picture(motion: Motion, title: str, file_format: str) -> bytes:
    """Return the picture as the bytes of a PNG or SVG file."""
    with matplotlib.style.context(_STYLE, after_reset=True), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # in the name of a user's file
        file = BytesIO()
        _draw(motion, title).savefig(file, format=file_format)
        return file.getvalue()


def _draw(motion: Motion, title: str) -> Figure:
    """Return the figure: panels over time on the left, the path of the TCP on the right."""
    robot, states = motion.description, motion.states
    times_s, tcp_mm = (
        np.array([each.time_s for each in states]),
        np.array([each.tool_frame[:3] for each in states]),
    )
    speed = np.linalg.norm(np.diff(tcp_mm, axis=0), axis=1) / np.diff(times_s)
    speed[speed > FASTEST_MM_S] = np.nan
    force = np.array([each.cartesian_force[:3] for each in states])
    share = np.array([each.joint_velocity for each in states]) / np.array(robot.velocity)
    rows = [
        ("joints (deg)", np.degrees([each.joint_position for each in states]), robot.joints),
        ("joint velocities\n(% of limits)", 100.0 * share, ()),
        ("TCP speed (mm/s)", np.append(0.0, speed), ()),
        *([("force at the TCP (N)", force, tuple("xyz"))] if force.any() else []),
    ]
    named = [move for move in motion.moves if move.name]
    named = named if len(named) <= MOST_NAMES else []
    figure = Figure(figsize=(12.0, 2.5 * len(rows)), layout="constrained")
    figure.suptitle(title, fontsize=10.5)
    left, right = figure.subfigures(1, 2, width_ratios=[1.5, 1.0], squeeze=False)[0]
    panels = list(left.subplots(len(rows), sharex=True))
    for panel, (label, values, names) in zip(panels, rows, strict=True):
        panel.set_ylabel(label)
        panel.margins(x=0.0)
        lines = panel.plot(times_s, values)
        if names:
            panel.legend(lines, names, loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.2)
        for time_s in [move.end_s for move in named if move.end_s is not None]:
            panel.axvline(time_s, color=_GREY, linewidth=1.0, zorder=1.0)
        for time_s, _ in motion.faults:
            panel.axvline(time_s, color=_RED, linewidth=1.0, zorder=1.0)
    for time_s, code in motion.faults:
        across = panels[0].get_xaxis_transform()
        panels[0].text(time_s, 1.0, f"error {code}", color=_RED, va="bottom", transform=across)
    panels[-1].set_xlabel("time (s)")
    left.align_ylabels(panels)
    _draw_path(right.subplots(), tcp_mm, motion.moves, named)
    return figure


def _draw_path(view: Axes, tcp_mm: NDArray[np.float64], moves: list[Move], named: list[Move]) -> None:
    """Draw the path of the TCP to scale, seen along the axis of the base along which it extends least."""
    first, second = [axis for axis in range(3) if axis != np.ptp(tcp_mm, axis=0).argmin()]
    view.plot(tcp_mm[:, first], tcp_mm[:, second])
    goals = [(move.goal_mm[first], move.goal_mm[second]) for move in moves]
    view.plot(*np.reshape(goals, (-1, 2)).T, "+")
    for move, goal in zip(moves, goals, strict=True):
        if move.blending_mm:
            view.add_patch(Circle(goal, move.blending_mm, color="#e69f00", alpha=0.2, linewidth=0.0))
        if move in named:
            view.annotate(move.name, goal, (5.0, 5.0), textcoords="offset points", fontsize=8.0)
    view.ticklabel_format(useOffset=False)
    view.set_aspect("equal", adjustable="datalim")
    view.set_xlabel(f"{'xyz'[first]} (mm)")
    view.set_ylabel(f"{'xyz'[second]} (mm)")
