"""Positions, velocities and accelerations of the joints, speed and force of the TCP over time, and the moves.

Velocities and accelerations are drawn as parts of the limits, which differ between joints: the joint at 100 %
determines the timing. A strip beside each panel has a bar per joint, thin from limit to limit and thick where
the joint has been; its colours are the legend of the panel.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MultipleLocator

from iiwa_sim.plot.forces import draw_forces, draw_legend
from iiwa_sim.plot.marks import COLOURS, FAULT, names, numbers, together
from iiwa_sim.plot.overlaps import dashes
from iiwa_sim.plot.record import Array, Recording
from iiwa_sim.robot.description import RobotDescription

_LIMIT: dict[str, Any] = {"color": "#555555", "linestyle": (0, (5, 3)), "linewidth": 0.9}
_PASSED: dict[str, Any] = {"color": "#999999", "linestyle": (0, (1, 2)), "linewidth": 1.0, "zorder": 1.0}
_FAULT: dict[str, Any] = {"color": FAULT, "linewidth": 1.2, "zorder": 1.5}
_CODE: dict[str, Any] = {
    "color": FAULT,
    "fontsize": 8.0,
    "fontweight": "bold",
    "path_effects": [withStroke(linewidth=2.5, foreground="white")],
}
_DEGREES_PER_TICK = 60.0
_ROUNDING_PERCENT = 1.0  # rounding of differences over ticks: less above a limit is no violation
_ROOM = 1.18  # above the highest limit, for its label
_MOST_LARGE = 12  # names of moves that fit beside a panel
_MOST_SMALL = 20  # of smaller ones, in a column
_COLUMN = 0.55  # width of a column of them, as part of a panel
_CLOSEST = 0.025  # part of the time shown: numbers nearer to each other share a label


def draw_over_time(figure: SubFigure, recording: Recording) -> None:
    """Fill a figure with the panels, and strips beside those of the joints."""
    heights = [1.0] * 4 + [1.5] * recording.has_forces
    rows = len(heights)
    grid = figure.add_gridspec(rows, 2, width_ratios=[4.5, 1.0], height_ratios=heights)
    first = figure.add_subplot(grid[0, 0])
    panels = [first, *(figure.add_subplot(grid[row, 0], sharex=first) for row in range(1, rows))]
    strips = [figure.add_subplot(grid[row, 1], sharey=panels[row]) for row in (0, 1, 2)]
    robot = recording.description
    low, high = np.degrees(robot.position_min), np.degrees(robot.position_max)
    draw_positions(panels[0], recording)
    _draw_used(strips[0], recording, np.degrees(recording.joints), low, high)
    full = np.full(len(robot.joints), 100.0)
    velocity = 100.0 * recording.velocity() / np.array(robot.velocity)
    panels[1].set_ylabel("joint velocity (% of limit)")
    _draw_joints(panels[1], recording, velocity, 200.0)
    _draw_used(strips[1], recording, velocity, -full, full)
    _draw_limit(panels[1], 100.0, "limit")
    acceleration = 100.0 * recording.acceleration() / np.array(robot.acceleration)
    panels[2].set_ylabel("joint acceleration (% of limit)")
    _draw_joints(panels[2], recording, acceleration, 200.0)
    _draw_used(strips[2], recording, acceleration, -full, full)
    for percent, name in _acceleration_limits(recording, float(np.abs(acceleration).max())):
        _draw_limit(panels[2], percent, name)
    draw_speed(panels[3], recording)
    _list_moves(figure.add_subplot(grid[3, 1]), names(recording))
    if recording.has_forces:
        draw_forces(panels[4], recording)
        draw_legend(figure.add_subplot(grid[4, 1]), panels[4])
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0.0, recording.duration_s)
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    strips[0].set_title("range used")
    _mark_passed(panels, recording)
    mark_faults(panels, recording)
    figure.align_ylabels(panels)


def draw_positions(panel: Axes, recording: Recording) -> None:
    """Fill a panel with the positions of the joints."""
    robot = recording.description
    range_deg = float(np.degrees(max(robot.position_max) - min(robot.position_min)))
    panel.set_ylabel("joint position (deg)")
    panel.yaxis.set_major_locator(MultipleLocator(_DEGREES_PER_TICK))
    _draw_joints(panel, recording, np.degrees(recording.joints), range_deg)


def draw_speed(panel: Axes, recording: Recording) -> None:
    """Fill a panel with the speed of the TCP."""
    speed_mm_s = recording.tcp_speed_mm_s()
    panel.set_ylabel("TCP speed (mm/s)")
    panel.plot(recording.times_s(), speed_mm_s, color=COLOURS[4])
    panel.set_ylim(0.0, 1.08 * max(float(speed_mm_s.max()), 1.0))


def mark_faults(panels: Sequence[Axes], recording: Recording) -> None:
    """Mark the times at which the error state has begun, with its codes in the first panel."""
    for fault in recording.faults:
        time_s = fault.tick * recording.tick_s
        for panel in panels:
            panel.axvline(time_s, **_FAULT)
        is_late = time_s > 0.5 * recording.duration_s
        panels[0].annotate(
            f"error {fault.code}",
            (time_s, 1.0),
            xycoords=panels[0].get_xaxis_transform(),
            xytext=(-3.0 if is_late else 3.0, -3.0),
            textcoords="offset points",
            horizontalalignment="right" if is_late else "left",
            verticalalignment="top",
            **_CODE,
        )


def _draw_joints(panel: Axes, recording: Recording, values: Array, height: float) -> None:
    """Draw values (ticks, joints) over time, in a panel of this height."""
    names, times_s = recording.description.joints, recording.times_s()
    for joint, style in enumerate(dashes(values, height)):
        colour = COLOURS[joint % len(COLOURS)]
        panel.plot(times_s, values[:, joint], color=colour, linestyle=style, label=names[joint])


def _draw_used(strip: Axes, recording: Recording, values: Array, low: Array, high: Array) -> None:
    """Draw the part of their limits that values (ticks, joints) use."""
    names = recording.description.joints
    for joint in range(len(names)):
        colour = COLOURS[joint % len(COLOURS)]
        strip.plot(
            [joint, joint],
            [low[joint], high[joint]],
            color="#aaaaaa",
            linewidth=1.0,
            marker="_",
            markersize=7.0,
            markeredgecolor="#555555",
        )
        used = [values[:, joint].min(), values[:, joint].max()]
        strip.plot([joint, joint], used, color=colour, linewidth=4.5, solid_capstyle="butt")
    strip.set_xticks(range(len(names)), names, fontsize=8.0)
    for joint, label in enumerate(strip.get_xticklabels()):
        label.set_color(COLOURS[joint % len(COLOURS)])
        label.set_parse_math(False)
    strip.set_xlim(-0.7, len(names) - 0.3)
    strip.tick_params(labelleft=False, left=False, bottom=False)
    strip.grid(visible=False, axis="x")


def _acceleration_limits(recording: Recording, used_percent: float) -> list[tuple[float, str]]:
    """The acceleration limits of the modes used, as percentages of the planned limit; the highest comes
    last."""
    robot = recording.description
    found = [(100.0, "limit")]
    stop = robot.stop_acceleration
    if any(target.mode == "direct" for target in recording.targets):
        found.append((_percent(robot.direct_acceleration, robot), "limit in direct mode"))
        stop = robot.direct_stop_acceleration
    if used_percent > found[-1][0] + _ROUNDING_PERCENT:
        found.append((_percent(stop, robot), "limit in a stop"))
    return found


def _percent(limits: Sequence[float], robot: RobotDescription) -> float:
    return 100.0 * float(np.divide(limits, robot.acceleration).max())


def _draw_limit(panel: Axes, percent: float, name: str) -> None:
    for level in (percent, -percent):
        panel.axhline(level, **_LIMIT)
    panel.set_ylim(-_ROOM * percent, _ROOM * percent)
    panel.annotate(
        name,
        (1.0, percent),
        xycoords=panel.get_yaxis_transform(),
        xytext=(-3.0, 2.0),
        textcoords="offset points",
        horizontalalignment="right",
        fontsize=7.5,
        color="#555555",
    )


def _list_moves(beside: Axes, moves: Sequence[str]) -> None:
    """List the moves that have numbers; more of them are written smaller, and in columns."""
    beside.set_axis_off()
    size_pt, rows = (8.0, len(moves)) if len(moves) <= _MOST_LARGE else (6.0, _MOST_SMALL)
    if moves:
        beside.set_title("moves")
    for column, first in enumerate(range(0, len(moves), max(rows, 1))):
        listed = "\n".join(moves[first : first + rows])
        beside.text(
            _COLUMN * column,
            1.0,
            listed,
            transform=beside.transAxes,
            verticalalignment="top",
            fontsize=size_pt,
            parse_math=False,
        )


def _mark_passed(panels: list[Axes], recording: Recording) -> None:
    """Mark the times at which moves to numbered targets ended or were blended into the next."""
    passed = [
        ((target.done_tick * recording.tick_s,), number)
        for target, number in zip(recording.targets, numbers(recording), strict=True)
        if number and target.done_tick is not None
    ]
    for (time_s,), _ in passed:
        for panel in panels:
            panel.axvline(time_s, **_PASSED)
    for (time_s,), label in together(passed, _CLOSEST * recording.duration_s):
        panels[0].annotate(
            label,
            (time_s, 1.0),
            xycoords=panels[0].get_xaxis_transform(),
            xytext=(0.0, 3.0),
            textcoords="offset points",
            horizontalalignment="center",
            fontsize=8.5,
            fontweight="bold",
        )
