"""Duration of two moves with a blended corner, relative to the fastest possible motion.

`data/corners_ROBOT.json` has the moves and their optima, which nonlinear optimisation (IPOPT) found within
some parts in a thousand.
"""

import json
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.told import Joints, Told, run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import compose
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model

DATA = Path(__file__).parent / "data"
ROBOTS = ("lbr_iiwa_7_r800", "kr_6_r900_sixx")
TICKS_S = (0.001, 0.002)
MEDIAN, P90, LARGEST = 1.04, 1.08, 1.15
"""Goals for the duration, relative to the optimum."""
SLOWEST_MM_S = {"named R5 v1": 60.0, "named R60 v1": 280.0}
"""Goals for the least speed of the TCP at named corners of the default robot."""


class Corner(NamedTuple):
    """Two moves from joint positions (rad), and their shortest duration (s) from rest to rest."""

    name: str
    start: Joints
    moves: list[Told]
    optimum_s: float


class CornerTimes(NamedTuple):
    """Durations (s) of a corner with its blending and with an exact stop, and its joints at each tick."""

    blended_s: float
    exact_s: float
    joints: NDArray[np.float64]


def corners(robot: str) -> list[Corner]:
    """The corners of a robot; the first six are named ones: lines of 200 mm at a right angle."""
    return [
        Corner(
            row["name"],
            tuple(row["start"]),
            [Told.from_line(line) for line in row["moves"]],
            row["optimum_s"],
        )
        for row in json.loads((DATA / f"corners_{robot}.json").read_text())["corners"]
    ]


def take(robot: str, corner: Corner, tick_s: float) -> CornerTimes:
    """Run a corner with its blending, and with an exact stop."""
    runs = []
    for blending in (True, False):
        controller = Controller(load_robot(robot), tick_s, start=corner.start)
        runs.append(run(controller, corner.moves, blending=blending))
    blended, exact = runs
    return CornerTimes((len(blended) - 1) * tick_s, (len(exact) - 1) * tick_s, blended)


def slowest_mm_s(robot: str, corner: Corner, taken: CornerTimes, tick_s: float) -> float:
    """The least speed of the TCP in the sphere round the corner."""
    description = load_robot(robot)
    model = Model(description)
    places = np.array(
        [compose(model.flange(q), description.tool_in_flange).translation for q in taken.joints.tolist()]
    )
    target = corner.moves[0].target[:3]
    inside = np.linalg.norm(1000.0 * places - target, axis=1) <= corner.moves[0].blending_mm
    speeds = 1000.0 * np.linalg.norm(np.diff(places, axis=0), axis=1) / tick_s
    return float(speeds[inside[1:] & inside[:-1]].min())


def _goal(at_most: float) -> dict[str, Any]:
    return {"at_most": at_most, "kind": Kind.SIMULATED}


def measure() -> list[Figure]:
    """Measure all corners of two robots, at 1,000 and 500 Hz."""
    figures = []
    for robot in ROBOTS:
        found = corners(robot)
        for tick_s in TICKS_S:
            taken = [take(robot, corner, tick_s) for corner in found]
            ratios = [now.blended_s / corner.optimum_s for now, corner in zip(taken, found, strict=True)]
            late = sum(now.blended_s > now.exact_s + 1.5 * tick_s for now in taken)
            of = f"{len(found)} corners of {robot}, {1.0 / tick_s:.0f} Hz"
            figures += [
                Figure(f"{of}: duration over optimum, median", median(ratios), "x", **_goal(MEDIAN)),
                Figure(f"{of}: duration over optimum, p90", percentile(ratios, 0.9), "x", **_goal(P90)),
                Figure(f"{of}: duration over optimum, largest", max(ratios), "x", **_goal(LARGEST)),
                Figure(f"{of}: later than with an exact stop", late, "", at_most=0, kind=Kind.SIMULATED),
            ]
            for corner, now in zip(found, taken, strict=True):
                if tick_s == TICKS_S[0] and robot == ROBOTS[0] and corner.name in SLOWEST_MM_S:
                    speed, least = slowest_mm_s(robot, corner, now, tick_s), SLOWEST_MM_S[corner.name]
                    name = f"corner {corner.name} of {robot}: slowest of the TCP in the sphere"
                    figures.append(Figure(name, speed, "mm/s", at_least=least, kind=Kind.SIMULATED))
    return figures
