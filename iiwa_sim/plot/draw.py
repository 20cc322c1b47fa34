"""Draws a recording: joints and forces over time, and the path of the TCP with targets and blending spheres.

Only this module and those that it draws with import matplotlib. They avoid pyplot and its global state, and
write no date and no random names: the same recording gives the same bytes.
"""

import warnings
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import matplotlib.style
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import Axes3D

from iiwa_sim.plot.over_time import draw_over_time
from iiwa_sim.plot.record import Recording
from iiwa_sim.plot.space import draw_space
from iiwa_sim.plot.tcp_views import draw_tcp_views
from iiwa_sim.wording import harmless, shortened

FORMATS = ("png", "svg")

_LONGEST_NAME = 60
_SIZE_IN = (13.5, 10.2)
_HIGHER_IN = 2.6  # if there are forces
STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.edgecolor": "#888888",
    "axes.titlesize": 9.0,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.3,
    "savefig.dpi": 110.0,
    "svg.hashsalt": "iiwa-sim",
}
_LAYOUT_DIGITS = 6  # fraction of the figure
_NO_TRACES: dict[str, dict[str, str | None]] = {"png": {"Software": None}, "svg": {"Date": None}}


def picture(recording: Recording, file_format: str) -> bytes:
    """The picture as the bytes of a file in one of the FORMATS."""
    with matplotlib.style.context(STYLE, after_reset=True), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # in the name of a user's file
        file = BytesIO()
        figure = draw(recording)
        settle(figure)
        figure.savefig(file, format=file_format, metadata=_NO_TRACES[file_format])
        return file.getvalue()


def settle(figure: Figure) -> None:
    """Compute the layout and freeze it; the last digits of a layout vary between runs."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for part in figure.subfigs:
        place: Bbox = cast(Any, part).bbox_relative  # missing in matplotlib's types
        place.set_points(place.get_points().round(_LAYOUT_DIGITS))
    for axes in figure.axes:
        axes.set_position(Bbox(axes.get_position().get_points().round(_LAYOUT_DIGITS)))


def draw(recording: Recording) -> Figure:
    """The figure: panels over time on the left; on the right the arm in space and two views of the path."""
    width_in, height_in = _SIZE_IN
    if recording.has_forces:
        height_in += _HIGHER_IN
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    figure.suptitle(title(recording), parse_math=False, fontsize=10.5)
    halves = figure.add_gridspec(1, 2, width_ratios=[1.5, 1.0])
    draw_over_time(figure.add_subfigure(halves[0]), recording)
    right = figure.add_subfigure(halves[1])
    grid = right.add_gridspec(3, 1, height_ratios=[1.35, 1.0, 1.0])
    draw_space(cast(Axes3D, right.add_subplot(grid[0], projection="3d")), recording)
    draw_tcp_views(right, right.add_subplot(grid[1]), right.add_subplot(grid[2]), recording)
    return figure


def title(recording: Recording) -> str:
    """File and robot of a recording, fit to be read, and how long it is."""
    file, robot = Path(recording.script.path).name, recording.description.name
    names = [shortened(harmless(name), _LONGEST_NAME) for name in (file, robot)]
    return f"{names[0]} on {names[1]}: {recording.duration_s:.2f} s at {1.0 / recording.tick_s:.0f} ticks/s"
