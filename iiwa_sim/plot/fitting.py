"""Which parts a scene and views of the TCP are made large enough for, besides the arm and the TCP's way."""

import numpy as np

from iiwa_sim.plot.record import Array, Recording
from iiwa_sim.plot.solids import polygons
from iiwa_sim.plot.things import Solid

NEAR_MM = 100.0
"""A part that lies no farther than this from the way of the TCP is seen, also where nothing happens to it."""
FARTHEST_MM = 1000.0
"""What is farther from the way of the TCP is left out, as a part that falls past the table: all else would be
too small."""


def seen_mm(recording: Recording) -> list[Array]:
    """Corners, each (n, 3), of the parts that have moved, were held, or lie near the way of the TCP: as they
    were at first and at last."""
    things, ticks = recording.things, (0, len(recording.joints) - 1)
    handled = things.handled(*ticks)
    found = []
    for tick in ticks:
        for name, solid in things.named_parts(tick):
            corners = corners_mm(solid)
            if _apart_mm(corners, recording.tcp_mm) <= (FARTHEST_MM if name in handled else NEAR_MM):
                found.append(corners)
    return found


def corners_mm(solid: Solid) -> Array:
    """All corners (n, 3) of the faces of a body."""
    return np.concatenate(polygons(solid))


def _apart_mm(corners: Array, way: Array) -> float:
    """How far the box round some corners is from the nearest place of the way."""
    beyond = np.maximum(np.maximum(corners.min(axis=0) - way, way - corners.max(axis=0)), 0.0)
    return float(np.linalg.norm(beyond, axis=1).min())
