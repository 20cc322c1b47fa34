"""The scene in three dimensions: the arm with tool, jaws, parts and force, the way of the TCP, surfaces."""

from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3D, Poly3DCollection

from iiwa_sim.plot.arm import arm_mm, flange, instants
from iiwa_sim.plot.fitting import seen_mm
from iiwa_sim.plot.marks import COLOURS, FORCE, JAW, PART, SURFACE, SURFACE_ALPHA, TOOL, TOUCH
from iiwa_sim.plot.record import Array, Recording
from iiwa_sim.plot.solids import cut_off, polygons
from iiwa_sim.plot.things import LEAST_N, LONGEST_M, M_PER_N, Solid

_AXES = "xyz"
_PATH = COLOURS[4]
_ARM: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round", "linewidth": 3.2}
_JOINTS: dict[str, Any] = {"marker": "o", "markersize": 4.2, "markerfacecolor": "white"}
_TOOL: dict[str, Any] = {"linewidth": 1.4}
_PALEST, _DARKEST = 0.8, 0.1  # greys of the first and the last instant
_ROOM = 0.05  # of the largest extent, round arm and path
_MOST_EDGES = 6  # faces that have their edges drawn: of a box, not of what is round
_LEGEND: dict[str, Any] = {
    "title": "arm at",
    "loc": "upper left",
    "bbox_to_anchor": (1.06, 1.0),
    "frameon": False,
    "fontsize": 8.0,
    "title_fontsize": 8.0,
    "handlelength": 1.2,
}


class ArmLines:
    """The arm in a panel: a line from joint to joint, and a thin one from the flange to the TCP."""

    def __init__(self, axes: Axes3D, points_mm: Array, grey: float, label: str = "") -> None:
        """`points_mm` as `arm_mm` gives them; `grey` is from 0, black, to 1."""
        colour = (grey, grey, grey)
        self._tool: Line3D
        self._arm: Line3D
        (self._tool,) = axes.plot([], [], [], color=colour, **_TOOL)
        (self._arm,) = axes.plot(
            [], [], [], color=colour, markeredgecolor=colour, label=label, **_ARM, **_JOINTS
        )
        self.show(points_mm)

    def show(self, points_mm: Array) -> None:
        """Draw it elsewhere."""
        self._arm.set_data_3d(*points_mm[:-1].T)
        self._tool.set_data_3d(*points_mm[-2:].T)


class HandledBodies:
    """Tool, jaws, parts and the force at the TCP in a panel, at one tick at a time."""

    def __init__(self, axes: Axes3D, recording: Recording, tick: int, alpha: float = 1.0) -> None:
        """`alpha` is from 0, not to be seen, to 1."""
        self._recording = recording
        self._low, self._high = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T
        self._bodies = [_collection(axes, solid, colour, alpha) for colour, solid in self._there(tick)]
        self._force: Line3D
        (self._force,) = axes.plot([], [], [], color=FORCE, linewidth=2.0, alpha=alpha)
        self.show(tick)

    def show(self, tick: int) -> None:
        """Draw them as they are at a tick. A part that has gone is nowhere."""
        recording, tcp = self._recording, self._recording.tcp(tick)
        solids = self._there(tick)
        for place, body in enumerate(self._bodies):
            body.set_verts(self._faces(*solids[place]) if place < len(solids) else [])
        force_n = np.array(tcp.to_transform().rotation).reshape(3, 3) @ recording.force_n[tick]
        size_n = float(np.linalg.norm(force_n))
        way = [recording.tcp_mm[tick]]
        if size_n >= LEAST_N:
            way.append(way[0] + 1e3 * min(M_PER_N * size_n, LONGEST_M) / size_n * force_n)
        self._force.set_data_3d(*np.array(way).T)

    def _faces(self, colour: str, solid: Solid) -> list[Array]:
        """Of a body: parts end where the scene does, as what they lie on."""
        return _within(polygons(solid), self._low, self._high) if colour == PART else polygons(solid)

    def _there(self, tick: int) -> list[tuple[str, Solid]]:
        """What there is at a tick, with its colours."""
        things = self._recording.things
        tool = things.tool(flange(self._recording, tick))
        jaws = things.jaws(tick, self._recording.tcp(tick))
        coloured = ((TOOL, tool), (JAW, jaws), (PART, things.parts(tick)))
        return [(colour, solid) for colour, solids in coloured for solid in solids]


def _collection(axes: Axes3D, solid: Solid, colour: str, alpha: float) -> Poly3DCollection:
    faces = polygons(solid)
    edge = (*to_rgb(colour), 0.6 * alpha if len(faces) <= _MOST_EDGES else 0.0)
    body = Poly3DCollection(faces, facecolor=(*to_rgb(colour), 0.55 * alpha), edgecolor=edge, linewidth=0.6)
    axes.add_collection3d(body)
    return body


def draw_space(axes: Axes3D, recording: Recording) -> None:
    """Fill a panel: the darker the arm, the later."""
    ticks = instants(recording)
    arms = [arm_mm(recording, tick) for tick in ticks]
    draw_scene(axes, recording, np.vstack(arms))
    axes.plot(*recording.tcp_mm.T, color=_PATH, linewidth=1.5)
    greys = np.linspace(_PALEST, _DARKEST, len(arms)) if len(arms) > 1 else [_DARKEST]
    for tick, arm, grey in zip(ticks, arms, greys, strict=True):
        ArmLines(axes, arm, float(grey), f"{tick * recording.tick_s:.2f} s")
        HandledBodies(axes, recording, tick, 1.0 - float(grey))
    axes.legend(**_LEGEND)


def draw_scene(axes: Axes3D, recording: Recording, arms_mm: Array) -> None:
    """Set up a panel to scale round the path, these points of the arm (n, 3) and parts that are to be seen,
    with what stands there."""
    seen = np.vstack([arms_mm, recording.tcp_mm, *seen_mm(recording)])
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = _ROOM * float((high - low).max())
    low, high = low - room, high + room
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple((high - low).tolist()), zoom=1.1)
    axes.view_init(elev=22.0, azim=-55.0)
    axes.tick_params(labelsize=7.0, pad=-2.0)
    for name, axis in zip(_AXES, (axes.xaxis, axes.yaxis, axes.zaxis), strict=True):
        axis.set_major_locator(MaxNLocator(4))
        axis.set_label_text(f"{name} (mm)", fontsize=7.5)
        axis.labelpad = -5.0
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    for surface in recording.surfaces:
        shown = _within(polygons(surface), low, high)
        if shown:
            colour = to_rgb(SURFACE)
            edge = (*colour, 0.6 if len(shown) <= _MOST_EDGES else 0.0)
            face = (*colour, SURFACE_ALPHA)
            axes.add_collection3d(Poly3DCollection(shown, facecolor=face, edgecolor=edge, linewidth=0.6))
    touches = recording.things.touches_mm
    if touches:
        axes.plot(*np.array(touches).T, color=TOUCH, marker="x", linestyle="", markersize=5.0)


def _within(faces: list[Array], low: Array, high: Array) -> list[Array]:
    """What of faces is in a box: most are, or are not, as a whole."""
    corners = np.concatenate(faces)
    if (corners >= low).all() and (corners <= high).all():
        return faces
    if (corners.max(axis=0) < low).any() or (corners.min(axis=0) > high).any():
        return []
    return [face for face in (cut_off(each, low, high) for each in faces) if len(face) > 2]
