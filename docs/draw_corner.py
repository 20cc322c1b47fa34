"""Draws docs/corner.svg, a right angle with four radii, from the simulator: python -m docs.draw_corner"""

from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from benchmarks.corners import ROBOTS, Corner, corners
from benchmarks.told import run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import compose
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model

PICTURE = Path(__file__).with_name("corner.svg")
ROBOT = ROBOTS[0]
RADII_MM = (5, 20, 60, 100)
"""Of the blending spheres."""
COLOURS = ("#0b5fa5", "#1a9a7a", "#d98c00", "#b0306a")
TICK_S = 0.001
BESIDE_MM = 110.0
"""So much of the path is drawn on either side of the target."""


class Passed(NamedTuple):
    """How the TCP passes a corner, tick by tick: where it is in mm, (ticks, 2), and its speed in mm/s."""

    places: NDArray[np.float64]
    speeds: NDArray[np.float64]


def passed(corner: Corner, *, blending: bool = True) -> Passed:
    """The target is at 0, 0; the lines go along y before it and downwards behind it."""
    description = load_robot(ROBOT)
    model = Model(description)
    joints = run(Controller(description, TICK_S, start=corner.start), corner.moves, blending=blending)
    flanges = (model.flange(q) for q in joints.tolist())
    places = np.array([compose(flange, description.tool_in_flange).translation for flange in flanges])
    places = 1000.0 * places - np.array(corner.moves[0].target[:3])
    return Passed(places[:, 1:], np.linalg.norm(np.diff(places, axis=0), axis=1) / TICK_S)


def draw(file: Path) -> None:
    """Write the picture as SVG, the same bytes for the same motion."""
    named = {corner.name: corner for corner in corners(ROBOT)}
    figure = Figure(figsize=(9.5, 3.4), layout="constrained")
    path, speed = figure.subplots(1, 2, width_ratios=(1.0, 1.6))
    for radius_mm, colour in zip(RADII_MM, COLOURS, strict=True):
        round_it = passed(named[f"named R{radius_mm} v1"])
        path.add_patch(Circle((0.0, 0.0), radius_mm, fill=False, color=colour, linestyle=":", linewidth=0.8))
        path.plot(*round_it.places.T, color=colour, linewidth=1.4)
        times = TICK_S * (0.5 + np.arange(len(round_it.speeds)))
        speed.plot(times, round_it.speeds, color=colour, linewidth=1.4, label=f"{radius_mm} mm")
    stopping = passed(named[f"named R{RADII_MM[0]} v1"], blending=False)
    times = TICK_S * (0.5 + np.arange(len(stopping.speeds)))
    speed.plot(times, stopping.speeds, color="0.5", linestyle="--", linewidth=1.2, label="a stop")
    path.set(xlim=(-BESIDE_MM, BESIDE_MM), ylim=(-BESIDE_MM, BESIDE_MM), aspect="equal")
    path.set(xlabel="y (mm)", ylabel="z (mm)", title="Path of the TCP; dotted: its spheres")
    speed.set(xlabel="time (s)", ylabel="TCP (mm/s)", title="Speed", ylim=(0.0, None))
    speed.legend(title="radius", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    for axes in (path, speed):
        axes.grid(visible=True, color="0.9")
    with mpl.rc_context({"svg.hashsalt": "corner"}):
        figure.savefig(file, format="svg", metadata={"Date": None})


if __name__ == "__main__":
    draw(PICTURE)
