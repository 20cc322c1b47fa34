"""Duration of single moves: lines relative to the time-optimum without jerk limit, joint lines to Ruckig."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.lines import LARGEST_TURN_RAD, LENGTHS_MM, random_joints
from benchmarks.time_optimal import Array, fastest_recorded_s, ruckig_s
from benchmarks.told import Joints, Told, run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import RobotDescription, load_robot

MOVES = 50
ROBOTS = ("lbr_iiwa_7_r800", "kr_6_r900_sixx")
LINE_TICK_S = 0.001
JOINT_TICK_S = 0.0002  # the shortest moves take about 20 ticks
SLOW_REL, SLOW_TICK_S = 0.02, 0.01  # slow, to record where a path goes
NEAR_MM = 0.01  # of its target: a line has come there
WAYS_RAD = (1e-5, 1e-4, 1e-3, 0.01, 0.03, 0.1)
"""Largest travel of a joint in short moves."""


class Single(NamedTuple):
    """A move alone, from joint positions (rad)."""

    start: Joints
    told: Told

    def recorded(self, description: RobotDescription, tick_s: float) -> Array:
        """Joint positions (ticks + 1, n) from rest to rest (rad)."""
        return run(Controller(description, tick_s, start=self.start), [self.told])


def random_lines(
    description: RobotDescription, count: int, seed: int, speed_rel: float = 1.0
) -> Iterator[Single]:
    """Random LIN of 200 to 600 mm in any direction, turning by up to 1 rad, anywhere the robot can do
    them: those that are refused, or end on their way since links meet, are left out and others drawn."""
    rng = np.random.default_rng(seed)
    controller = Controller(description, LINE_TICK_S)
    while count:
        start = random_joints(description, rng)
        way, turn = rng.normal(size=3), rng.normal(size=3)
        way *= rng.uniform(*LENGTHS_MM) / np.linalg.norm(way)
        turn *= rng.uniform(0.0, LARGEST_TURN_RAD) / np.linalg.norm(turn)
        target = Frame(*np.add(controller.tcp_frame_at(start), (*way, *turn)).tolist())
        line = Single(start, Told("lin", target, speed_rel))
        try:
            end = controller.tcp_frame_at(line.recorded(description, LINE_TICK_S)[-1].tolist())
        except Refused:
            continue
        if np.allclose(end[:3], target[:3], atol=NEAR_MM):
            yield line
            count -= 1


def random_joint_lines(description: RobotDescription, count: int, seed: int) -> Iterator[Single]:
    """Random joint lines between any two positions."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield Single(random_joints(description, rng), Told("joint", random_joints(description, rng), 1.0))


def short_joint_lines(description: RobotDescription, seed: int) -> Iterator[Single]:
    """Short joint lines, of all joints and of one alone."""
    rng = np.random.default_rng(seed)
    count = len(description.joints)
    for way in WAYS_RAD:
        for alone in (*range(count), *[None] * 4):
            start = np.array(random_joints(description, rng))
            shift = rng.uniform(-way, way, count) if alone is None else way * np.eye(count)[alone]
            yield Single(tuple(start.tolist()), Told("joint", tuple((start + shift).tolist()), 1.0))


def over_optimum(description: RobotDescription, line: Single) -> float:
    """Duration of a line, relative to the fastest motion on its path without jerk limit.

    The path is recorded at low speed.
    """
    slow = line._replace(told=line.told._replace(speed_rel=SLOW_REL)).recorded(description, SLOW_TICK_S)
    taken_s = (len(line.recorded(description, LINE_TICK_S)) - 1) * LINE_TICK_S
    return taken_s / fastest_recorded_s(slow, description, line.told.speed_rel)


def over_ruckig(description: RobotDescription, line: Single) -> tuple[float, float]:
    """Duration of a joint line relative to Ruckig's, as a ratio and as a difference (s)."""
    # The last tick is not counted: the motion may have ended anywhere within it.
    taken_s = (len(line.recorded(description, JOINT_TICK_S)) - 2) * JOINT_TICK_S
    optimum_s = ruckig_s(line.start, tuple(line.told.target), description)
    return taken_s / optimum_s, taken_s - optimum_s


def _goal(at_most: float, margin: float) -> dict[str, Any]:
    """A goal, and by how much the gate lets it be missed: lines of the KR 6 take 1.08 and 1.16, and no motion
    within its limits of jerk could take less than 1.07 and 1.13."""
    return {"at_most": at_most, "kind": Kind.SIMULATED, "margin": margin}


def measure() -> list[Figure]:
    """Measure 50 random lines and 50 random joint lines of two robots, and short joint lines."""
    figures = []
    for name in ROBOTS:
        robot = load_robot(name)
        lin = [over_optimum(robot, line) for line in random_lines(robot, MOVES, seed=1)]
        of = f"LIN of {name}: duration over time-optimal without jerk limit"
        long = [over_ruckig(robot, line) for line in random_joint_lines(robot, MOVES, seed=1)]
        short = [over_ruckig(robot, line) for line in short_joint_lines(robot, seed=1)]
        figures += [
            Figure(f"{of}, median", percentile(lin, 0.5), "x", **_goal(1.07, 1.02)),
            Figure(f"{of}, p95", percentile(lin, 0.95), "x", **_goal(1.11, 1.05)),
        ]
        for kind, found in (("PTP", long), (f"PTP of {WAYS_RAD[0]:g} to {WAYS_RAD[-1]:g} rad", short)):
            ratios, differences_s = zip(*found, strict=True)
            of = f"{kind} of {name}: duration over Ruckig's"
            figures += [
                Figure(f"{of}, median", percentile(ratios, 0.5), "x"),
                Figure(f"{of}, largest", max(ratios), "x", **_goal(1.01, 1.0)),
                Figure(f"{of}, largest excess", 1e3 * max(differences_s), "ms", **_goal(8.0, 1.0)),
            ]
    return figures
