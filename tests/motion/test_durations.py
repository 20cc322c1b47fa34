"""Durations: blended corners beside the fastest possible, dense paths beside those stored.

`data/corners_ROBOT.json` has two moves for each corner, and their optimum, which nonlinear optimisation
found within some parts in a thousand. `data/dense_paths.json` has ticks of many short blended lines, as a CAM
program sends them.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from tests.requests import lin_move, ptp_move
from tests.sequences import ROOMY
from tests.stepped import ARMS, SteppedRobot, assert_within_limits

DATA = Path(__file__).parent / "data"
TICK_S = 0.002
MEDIAN, P90, LARGEST = 1.04, 1.08, 1.15
"""Bounds of the duration over the optimum."""
SLOWEST_MM_S = {"named R5 v1": 60.0, "named R60 v1": 280.0}
"""Least speeds of the TCP at named corners."""
CIRCLES_MM = {0.5: 15.0, 2.0: 40.0, 5.0: 60.0}
"""Radius of a circle, by the length of its lines."""
LINES = {2: 40, 5: 40, 10: 40, 30: 14}
"""Number of a polyline's lines, by their length (mm)."""
FOUR_WAIT, ENOUGH = "as four wait", 4
SAMPLE = 23  # every one of so many dense paths
NAMED = (
    ("kr_6_r900_sixx", "circle of 0.5 mm lines at 1", "at once"),
    ("lbr_iiwa_14_r820", "circle of 2 mm lines at 0.02", "at once"),
    ("lbr_iiwa_7_r800", "polyline of 2 mm, 10 deg, R = L/2", FOUR_WAIT),
)
DENSE = [
    (robot, path, feed, ticks)
    for robot, of_robot in json.loads((DATA / "dense_paths.json").read_text())["ticks"].items()
    for path, of_path in of_robot.items()
    for feed, ticks in of_path.items()
]
both = pytest.mark.parametrize("robot", ARMS)


def run(
    robot: str, start: Sequence[float], moves: Sequence[MoveRequest], feed: str = "at once"
) -> list[tuple[float, ...]]:
    """Joint positions at each tick from rest to rest, of moves sent at once, one a tick, or as four wait."""
    controller = Controller(load_robot(robot), TICK_S, start=start)
    unsent, joints = list(reversed(moves)), [controller.joints]
    while unsent or controller.moving:
        if feed == "one a tick" and unsent:
            controller.move(unsent.pop())
        while unsent and (feed == "at once" or (feed == FOUR_WAIT and controller.motions.behind < ENOUGH)):
            controller.move(unsent.pop())
        controller.step()
        joints.append(controller.joints)
    return joints


def corners(robot: str) -> list[dict[str, Any]]:
    """Return the corners of a robot; the first six are named ones: lines of 200 mm at a right angle."""
    found: list[dict[str, Any]] = json.loads((DATA / f"corners_{robot}.json").read_text())["corners"]
    return found


def taken(robot: str, corner: dict[str, Any], blending: bool = True) -> list[tuple[float, ...]]:
    moves = []
    for line in corner["moves"]:
        kind, values = line.split(" : ")
        *frame, speed_rel, blending_mm = map(float, values.split())
        move = {"lin move": lin_move, "ptp move": ptp_move}[kind]
        moves.append(move(Frame(*frame), speed_rel, blending_mm if blending else 0.0))
    return run(robot, corner["start"], moves)


def over_optimum(corner: dict[str, Any], joints: Sequence[object]) -> float:
    return (len(joints) - 1) * TICK_S / float(corner["optimum_s"])


@pytest.mark.slow
@pytest.mark.requirement("FRC009", "FRC012", "FRC015")
@both
def test_blends_are_near_their_optimum_and_never_slower_than_exact_stops(robot: str) -> None:
    ratios = []
    for corner in corners(robot):
        blended, exact = taken(robot, corner), taken(robot, corner, blending=False)
        assert len(blended) <= len(exact) + 1, corner["name"]
        assert len(exact) * TICK_S <= 1.01 * corner["exact_before_s"], corner["name"]
        ratios.append(over_optimum(corner, blended))
    assert median(ratios) <= MEDIAN
    assert np.percentile(ratios, 90) <= P90
    assert max(ratios) <= LARGEST


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_the_named_blends_are_passed_at_speed_near_their_optimum(robot: str) -> None:
    for corner in corners(robot):
        if corner["name"] in SLOWEST_MM_S:
            joints, stepped = taken(robot, corner), SteppedRobot(robot)
            assert over_optimum(corner, joints) <= P90
            places = 1e3 * np.array([stepped.tcp(q).translation for q in joints])
            *target, _, _, _, _, blending_mm = map(float, corner["moves"][0].split(" : ")[1].split())
            inside = np.linalg.norm(places - target, axis=1) <= blending_mm
            speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / TICK_S
            assert speeds[inside[1:] & inside[:-1]].min() >= SLOWEST_MM_S[corner["name"]]


def dense(path: str) -> tuple[NDArray[np.float64], float, float]:
    """Return corners in y and z about the middle (mm), blending (mm) and relative speed of a dense path."""
    line_mm, *numbers = (float(each) for each in re.findall(r"[\d.]+", path))
    if path.startswith("circle"):
        radius_mm = CIRCLES_MM[line_mm]
        angles = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * radius_mm / line_mm) + 1)
        return radius_mm * np.stack([np.sin(angles), np.cos(angles)], axis=1), line_mm / 2.0, numbers[0]
    angle_deg, part = numbers
    half = np.radians(angle_deg) / 2.0
    turns = [(np.cos(half), np.sin(half) * (-1.0) ** k) for k in range(LINES[int(line_mm)])]
    polyline = np.concatenate([np.zeros((1, 2)), np.cumsum(line_mm * np.array(turns), axis=0)])
    return polyline - polyline.mean(axis=0), line_mm / part, 1.0


@pytest.mark.slow
@pytest.mark.requirement("FRC015")
@pytest.mark.parametrize(
    ("robot", "path", "feed", "ticks"), [*(each for each in DENSE if each[:3] in NAMED), *DENSE[::SAMPLE]]
)
def test_a_dense_path_takes_no_longer_than_stored_and_keeps_its_limits(
    robot: str, path: str, feed: str, ticks: int
) -> None:
    around, blending_mm, speed_rel = dense(path)
    recorded = SteppedRobot(robot)
    recorded.controller.place(ROOMY.get(robot, ROOMY[ARMS[0]]))
    middle = recorded.controller.tool_frame()
    frames = [middle._replace(y_mm=middle.y_mm + y, z_mm=middle.z_mm + z) for y, z in around.tolist()]
    recorded.controller.move(ptp_move(frames[0], 1.0, 0.0))
    recorded.runs_until_stopped()
    moves = [lin_move(frame, speed_rel, blending_mm) for frame in frames[1:]]
    recorded.joints = run(robot, recorded.controller.joints, moves, feed)
    recorded.stopping = recorded.direct = [False] * len(recorded.joints)
    assert len(recorded.joints) - 1 <= ticks + 1
    assert_within_limits(recorded)
