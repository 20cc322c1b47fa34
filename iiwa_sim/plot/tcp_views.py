"""The path of the TCP from above and from the side, with targets, blending spheres, places where forces have
ended moves, and what stands there.

Parallel projections, both to scale: a sphere is a circle of its radius, and lengths can be read off.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import SubFigure
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke

from iiwa_sim.plot.fitting import seen_mm
from iiwa_sim.plot.marks import COLOURS, JAW, PART, SURFACE, SURFACE_ALPHA, TOUCH, Place, numbers, together
from iiwa_sim.plot.record import Array, Recording
from iiwa_sim.plot.solids import outline

_AXES = "xyz"
_PATH, _SPHERE = COLOURS[4], COLOURS[1]
_START: dict[str, Any] = {
    "color": _PATH,
    "marker": "o",
    "markerfacecolor": "white",
    "markersize": 7.0,
    "linestyle": "",
    "label": "start",
}
_TARGET: dict[str, Any] = {
    "color": COLOURS[5],
    "marker": "+",
    "markersize": 8.0,
    "markeredgewidth": 1.5,
    "linestyle": "",
    "label": "target",
}
_STREAMED: dict[str, Any] = {
    "color": COLOURS[5],
    "marker": ".",
    "markersize": 2.5,
    "linestyle": "",
    "label": "streamed target",
}
_ENDED: dict[str, Any] = {
    "color": COLOURS[0],
    "marker": "x",
    "markersize": 6.0,
    "markeredgewidth": 1.5,
    "linestyle": "",
    "label": "ended by a force",
}
_TOUCHED: dict[str, Any] = {**_ENDED, "color": TOUCH, "label": "a link touches"}
_NUMBER: dict[str, Any] = {
    "fontsize": 8.5,
    "fontweight": "bold",
    "path_effects": [withStroke(linewidth=2.5, foreground="white")],
}
_LEGEND: dict[str, Any] = {
    "loc": "outside lower center",
    "frameon": False,
    "fontsize": 8.5,
    "columnspacing": 1.2,
    "handlelength": 1.2,
    "handletextpad": 0.5,
}
_MOST_IN_A_ROW = 5
_CLOSEST = 0.04  # part of the extent: numbers nearer to each other share a label
_BESIDE_MM = 15.0  # margin round parts, so that what they lie on is seen, too
_SMALLEST_MM = 1.0  # margin round the path: a TCP at rest has no extent of its own


def draw_tcp_views(figure: SubFigure, above: Axes, side: Axes, recording: Recording) -> None:
    """Fill two panels of a figure with the two views, and put their legend below."""
    seen = seen_mm(recording)
    x_mm, y_mm, _ = np.ptp(recording.tcp_mm, axis=0)
    _draw_view(above, recording, (0, 1), seen)
    above.set_title("TCP seen from above")
    if x_mm >= y_mm:
        _draw_view(side, recording, (0, 2), seen)
        side.set_title("TCP seen from the side")
    else:
        _draw_view(side, recording, (1, 2), seen)
        side.set_title("TCP seen from the front")
    handles, labels = above.get_legend_handles_labels()
    columns = len(labels) if len(labels) <= _MOST_IN_A_ROW else (len(labels) + 1) // 2
    figure.legend(handles, labels, ncols=columns, **_LEGEND)


def _draw_view(view: Axes, recording: Recording, axes: tuple[int, int], seen: list[Array]) -> None:
    """Fill a view, which is large enough for the way of the TCP and for the corners of parts to be `seen`."""
    first, second = axes
    way = recording.tcp_mm[:, list(axes)]
    _draw_surfaces(view, recording, axes)
    _draw_bodies(view, recording, axes)
    view.plot(way[:, 0], way[:, 1], color=_PATH, linewidth=1.5, label="TCP")
    view.plot(way[0, 0], way[0, 1], **_START)
    spheres = [
        Circle((target.tcp_mm[first], target.tcp_mm[second]), target.blending_mm)
        for target in recording.targets
        if target.blending_mm > 0.0
    ]
    for sphere in spheres:
        sphere.set(facecolor=(*to_rgb(_SPHERE), 0.15), edgecolor=_SPHERE, linewidth=1.0)
        view.add_patch(sphere)
    if spheres:
        spheres[0].set_label("blending sphere")
    numbered: list[tuple[Place, str]] = []
    streamed: list[tuple[Place, str]] = []
    for target, number in zip(recording.targets, numbers(recording), strict=True):
        place = (target.tcp_mm[first], target.tcp_mm[second])
        (streamed if target.servo else numbered).append((place, number))
    for found, form in ((numbered, _TARGET), (streamed, _STREAMED)):
        if found:
            places = np.array([place for place, _ in found])
            view.plot(places[:, 0], places[:, 1], **form)
    ended = [watch.contact.tcp[:3] for watch in recording.watches if watch.contact is not None]
    if ended:
        places = np.array(ended)
        view.plot(places[:, first], places[:, second], **_ENDED)
    touches = recording.things.touches_mm
    if touches:
        places = np.array(touches)
        view.plot(places[:, first], places[:, second], **_TOUCHED)
    extent_mm = float(np.ptp(way, axis=0).max()) + _SMALLEST_MM
    for (x_mm, y_mm), label in together([each for each in numbered if each[1]], _CLOSEST * extent_mm):
        view.annotate(label, (x_mm, y_mm), xytext=(5.0, 5.0), textcoords="offset points", **_NUMBER)
    view.update_datalim([way.min(axis=0) - _SMALLEST_MM, way.max(axis=0) + _SMALLEST_MM])
    for each in seen:
        corners = each[:, list(axes)]
        view.update_datalim([corners.min(axis=0) - _BESIDE_MM, corners.max(axis=0) + _BESIDE_MM])
    view.ticklabel_format(useOffset=False)
    view.set_aspect("equal", adjustable="datalim")
    view.set_xlabel(f"{_AXES[first]} (mm)")
    view.set_ylabel(f"{_AXES[second]} (mm)")


def _draw_surfaces(view: Axes, recording: Recording, axes: tuple[int, int]) -> None:
    """Draw what surfaces cover in a view, which is not made larger for them."""
    outlines = [outline(surface, axes) for surface in recording.surfaces]
    shown = [corners for corners in outlines if corners is not None]
    for place, corners in enumerate(shown):
        face = (*to_rgb(SURFACE), SURFACE_ALPHA)
        label = "surface" if not place else ""
        view.add_artist(
            Polygon(corners, facecolor=face, edgecolor=SURFACE, linewidth=0.8, zorder=0.5, label=label)
        )


def _draw_bodies(view: Axes, recording: Recording, axes: tuple[int, int]) -> None:
    """Draw the outlines of parts and jaws as they were at first, dashed, and at last."""
    things = recording.things
    for tick, line in ((0, "--"), (len(recording.joints) - 1, "-")):
        for solids, colour, label in (
            (things.parts(tick), PART, "part"),
            (things.jaws(tick, recording.tcp(tick)), JAW, "jaw"),
        ):
            for place, solid in enumerate(solids):
                corners = outline(solid, axes)
                assert corners is not None, "none of these is a plane"
                view.add_artist(
                    Polygon(
                        corners,
                        facecolor=(*to_rgb(colour), 0.35 if line == "-" else 0.0),
                        edgecolor=colour,
                        linestyle=line,
                        linewidth=0.9,
                        zorder=0.6,
                        label=label if line == "-" and not place else "",
                    )
                )
