"""Films of a recording: the arm in its cell as time passes, and beside it joints, speed and forces.

Matplotlib's own writers write them. A film plays at the robot's pace or, where that would take too many
pictures, faster.
"""

import re
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any, cast

import matplotlib.style
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, HTMLWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3D

from iiwa_sim.plot.arm import arm_mm
from iiwa_sim.plot.draw import STYLE, settle, title
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.plot.forces import draw_forces
from iiwa_sim.plot.marks import COLOURS, numbers
from iiwa_sim.plot.over_time import draw_positions, draw_speed, mark_faults
from iiwa_sim.plot.record import Recording
from iiwa_sim.plot.space import ArmLines, HandledBodies, draw_scene

PICTURES_PER_S = 20
MOST_PICTURES = 300
"""Most pictures of a film, which are all in memory at once: 15 s; a longer motion is played faster."""

_SIZE_IN = (10.0, 5.2)
_DPI = 90.0
_LARGEST_PAGE_MB = 500.0  # as many pictures have some 20 MB; the writer would leave out what goes beyond
_EXTENT_TICKS = 40  # at which the arm is looked at, for the extent of the scene
_ARM_GREY = 0.25
_AHEAD: dict[str, Any] = {"color": "#b9c7d6", "linewidth": 1.0}
_PASSED: dict[str, Any] = {"color": COLOURS[4], "linewidth": 1.8}
_LEGEND: dict[str, Any] = {
    "loc": "lower center",
    "bbox_to_anchor": (0.5, 0.98),
    "ncols": 7,
    "frameon": False,
    "fontsize": 7.0,
    "handlelength": 1.0,
    "handletextpad": 0.4,
    "columnspacing": 0.9,
    "borderpad": 0.1,
}
_NOW: dict[str, Any] = {"color": "#555555", "linewidth": 1.0}
_ELSEWHERE = re.compile(r"<link\b[^>]*>")
# The player's buttons have their symbols from a font of another host, which the page does without. These are
# in most fonts, which those of video players are not.
_SYMBOLS = {
    "minus": r"\2212",
    "fast-backward": r"|\25C0",
    "step-backward": r"\2039",
    "play": r"\25B6",
    "pause": "||",
    "step-forward": r"\203A",
    "fast-forward": r"\25B6|",
    "plus": "+",
}


def film(recording: Recording, file_format: str) -> bytes:
    """The film as the bytes of a file: gif, mp4 or html. Raises `PlotFault` where it cannot be made."""
    if file_format == "mp4" and not FFMpegWriter.isAvailable():
        raise PlotFault(
            "a film in .mp4 needs the program ffmpeg, which is not in PATH: install it, or take .gif or .html"
        )
    writer = _WRITERS[file_format]()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"film.{file_format}")
        with matplotlib.style.context(STYLE, after_reset=True), warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing from")  # in the name of a user's file
            figure, show = _staged(recording)
            try:
                with writer.saving(figure, str(file), _DPI):
                    for tick in ticks_shown(recording):
                        show(tick)
                        writer.grab_frame()
            except (CalledProcessError, BrokenPipeError):
                raise PlotFault("a film in .mp4 could not be made: the program ffmpeg has failed") from None
        data = file.read_bytes()
    return _by_itself(data.decode()).encode() if file_format == "html" else data


def ticks_shown(recording: Recording) -> list[int]:
    """The ticks of the pictures, from the first to the last, at even times."""
    last = len(recording.joints) - 1
    count = min(max(round(recording.duration_s * PICTURES_PER_S), 1), MOST_PICTURES - 1)
    return [round(last * each / count) for each in range(count + 1)]


def _html() -> HTMLWriter:
    return HTMLWriter(fps=PICTURES_PER_S, embed_frames=True, embed_limit=_LARGEST_PAGE_MB)


_WRITERS: dict[str, Callable[[], AbstractMovieWriter]] = {
    "gif": lambda: PillowWriter(fps=PICTURES_PER_S),
    "mp4": lambda: FFMpegWriter(fps=PICTURES_PER_S),
    "html": _html,
}


def _staged(recording: Recording) -> tuple[Figure, Callable[[int], None]]:
    """The figure, and what makes it show a tick."""
    figure = Figure(figsize=_SIZE_IN, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title(recording), parse_math=False, fontsize=10.0)
    rows = 2 + recording.has_forces
    grid = figure.add_gridspec(rows, 2, width_ratios=[1.3, 1.0])
    space = cast(Axes3D, figure.add_subplot(grid[:, 0], projection="3d"))
    panels = [figure.add_subplot(grid[row, 1]) for row in range(rows)]
    draw_positions(panels[0], recording)
    draw_speed(panels[1], recording)
    if recording.has_forces:
        draw_forces(panels[2], recording)
        panels[2].legend(**_LEGEND)
    panels[0].legend(**_LEGEND)
    for panel in panels:
        panel.set_xlim(0.0, recording.duration_s)
    mark_faults(panels, recording)
    panels[-1].set_xlabel("time (s)")
    show = _Stage(space, panels, recording).show
    show(0)
    settle(figure)
    return figure, show


class _Stage:
    """What moves in a film."""

    def __init__(self, space: Axes3D, panels: list[Axes], recording: Recording) -> None:
        self._recording = recording
        self._space = space
        last = len(recording.joints) - 1
        ticks = sorted({round(last * each / _EXTENT_TICKS) for each in range(_EXTENT_TICKS + 1)})
        draw_scene(space, recording, np.vstack([arm_mm(recording, tick) for tick in ticks]))
        space.plot(*recording.tcp_mm.T, **_AHEAD)
        self._passed: Line3D
        (self._passed,) = space.plot([], [], [], **_PASSED)
        self._arm = ArmLines(space, arm_mm(recording, 0), _ARM_GREY)
        self._handled = HandledBodies(space, recording, 0)
        self._now = [panel.axvline(0.0, **_NOW) for panel in panels]
        self._moves = sorted(
            (target.done_tick, f"{number} {target.name}")
            for target, number in zip(recording.targets, numbers(recording), strict=True)
            if number and target.done_tick is not None
        )

    def show(self, tick: int) -> None:
        recording = self._recording
        time_s = tick * recording.tick_s
        self._passed.set_data_3d(*recording.tcp_mm[: tick + 1].T)
        self._arm.show(arm_mm(recording, tick))
        self._handled.show(tick)
        for line in self._now:
            line.set_xdata([time_s, time_s])
        move = next((name for done, name in self._moves if done >= tick), "")
        self._space.set_title(f"{time_s:.2f} s  {move}", parse_math=False)


def _by_itself(page: str) -> str:
    """A page that asks no other host for anything."""
    symbols = "\n".join(f'.fa-{name}::before {{ content: "{text}" }}' for name, text in _SYMBOLS.items())
    flipped = ".fa-flip-horizontal { display: inline-block; transform: scaleX(-1) }"
    style = f"<style>\n.fa {{ font-style: normal }}\n{symbols}\n{flipped}\n</style>\n"
    return _ELSEWHERE.sub("", page) + style
