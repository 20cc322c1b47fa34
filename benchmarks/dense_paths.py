"""Dense paths: many short blended lines, as sent by a CAM program or a Cartesian trajectory.

The figure is the number of ticks relative to that of the previous planner (`data/dense_paths.json`).
"""

import json
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

from benchmarks.figures import Figure, Kind
from benchmarks.told import Joints, Told, run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.requests import Kind as How
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot

Points = NDArray[np.float64]

BEFORE = Path(__file__).parent / "data" / "dense_paths.json"
TICK_S = 0.002
STARTS: dict[str, Joints] = {
    "lbr_iiwa_7_r800": (0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0),
    "lbr_iiwa_14_r820": (0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0),
    "kr_6_r900_sixx": (0.0, -1.5, 1.6, 0.0, 1.4, 0.0),
}
"""Joints (rad) with room for a path around the TCP."""

CIRCLES = ((0.5, 15.0), (2.0, 40.0), (5.0, 60.0))
"""Lengths of the lines and radii of the circles (mm)."""
ANGLES_DEG = (5, 10, 20, 30, 45, 60, 90)
LINES = {2: 40, 5: 40, 10: 40, 30: 14}
"""Length of a polyline's lines (mm), and their number."""


def paths() -> dict[str, tuple[Points, float, float]]:
    """Corners in y and z, relative to the middle (mm), blending (mm) and relative speed, by name."""
    found: dict[str, tuple[Points, float, float]] = {}
    for line_mm, radius_mm in CIRCLES:
        for speed_rel in (1.0, 0.02):
            name = f"circle of {line_mm:g} mm lines at {speed_rel:g}"
            found[name] = circle(line_mm, radius_mm), line_mm / 2.0, speed_rel
    for line_mm, count in LINES.items():
        for angle_deg in ANGLES_DEG:
            for part in (5, 2):
                name = f"polyline of {line_mm} mm, {angle_deg} deg, R = L/{part}"
                found[name] = polyline(line_mm, count, angle_deg), line_mm / part, 1.0
    return found


def circle(line_mm: float, radius_mm: float) -> Points:
    """A circle of lines."""
    count = round(2.0 * np.pi * radius_mm / line_mm)
    angles = np.linspace(0.0, 2.0 * np.pi, count + 1)
    return radius_mm * np.stack([np.sin(angles), np.cos(angles)], axis=1)


def polyline(line_mm: float, count: int, angle_deg: float) -> Points:
    """Lines that turn by an angle, alternately to either side, through the middle."""
    half = np.radians(angle_deg) / 2.0
    steps = line_mm * np.array([(np.cos(half), np.sin(half) * (-1.0) ** k) for k in range(count)])
    corners = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return corners - corners.mean(axis=0)


def joints_along(robot: str, path: str, feed: str, tick_s: float = TICK_S) -> NDArray[np.float64]:
    """Joint positions (ticks + 1, n) from rest to rest (rad) along a path."""
    corners, blending_mm, speed_rel = paths()[path]
    controller = Controller(load_robot(robot), tick_s)
    controller.place(STARTS[robot])
    middle = controller.tool_frame()

    def at(corner: Points) -> Frame:
        return middle._replace(y_mm=middle.y_mm + float(corner[0]), z_mm=middle.z_mm + float(corner[1]))

    controller.move(MoveRequest(How.PTP, at(corners[0])))
    while controller.moving:
        controller.step()
    start = controller.joints
    controller = Controller(load_robot(robot), tick_s, start=start)
    return run(controller, [Told("lin", at(corner), speed_rel, blending_mm) for corner in corners[1:]], feed)


def before() -> Iterator[tuple[str, str, str, int]]:
    """Robot, path, feed, and the number of ticks of the previous planner."""
    for robot, of_robot in json.loads(BEFORE.read_text())["ticks"].items():
        for path, of_path in of_robot.items():
            for feed, ticks in of_path.items():
                yield robot, path, feed, ticks


def measure() -> list[Figure]:
    """Measure all paths, robots and feeds, some 25 s."""
    ratios: dict[tuple[str, str, str], list[float]] = {}
    late = 0
    for robot, path, feed, ticks in before():
        now = len(joints_along(robot, path, feed)) - 1
        ratios.setdefault((robot, path.split(" of ")[0], feed), []).append(now / ticks)
        late += now > ticks + 1
    figures = [Figure("dense paths over a tick later than before", late, "", at_most=1, kind=Kind.SIMULATED)]
    for (robot, kind, feed), found in ratios.items():
        of = f"{kind}s of {robot}, sent {feed}, ticks over before"
        figures += [
            Figure(f"{of}, median", median(found), "x"),
            Figure(f"{of}, largest", max(found), "x", at_most=1.01, kind=Kind.SIMULATED),
        ]
    return figures
