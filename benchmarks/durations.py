"""How long moves take, over the time-optimum along the same path; and what planning their timing costs."""

from time import thread_time

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.lines import chain_of, random_joint_lines, random_lines
from benchmarks.time_optimal import fastest_without_jerk_limit_s, ruckig_s
from iiwa_sim.controller.planner import Plan
from iiwa_sim.robot.description import load_robot

MOVES = 50


def measure() -> list[Figure]:
    """Durations of 50 random lines and 50 random joint moves of the default robot."""
    robot = load_robot()
    lines = list(random_lines(robot, MOVES, seed=1))
    joint_lines = list(random_joint_lines(robot, MOVES, seed=1))
    planning_us = sorted(_planning_us(plan) for plan in lines)
    lin = [chain_of(plan).rest_s / fastest_without_jerk_limit_s(plan.path, robot) for plan in lines]
    ptp = [chain_of(plan).rest_s / ruckig_s(plan.path, robot) for plan in joint_lines]
    return [
        Figure(
            "LIN duration over time-optimal without jerk limit, median",
            percentile(lin, 0.5),
            "x",
            at_most=1.25,
            kind=Kind.SIMULATED,
        ),
        Figure("LIN duration over time-optimal without jerk limit, p95", percentile(lin, 0.95), "x"),
        Figure("planning the timing of a LIN, p50", percentile(planning_us, 0.5), "us"),
        Figure("planning the timing of a LIN, p95", percentile(planning_us, 0.95), "us"),
        Figure("PTP duration over Ruckig's, median", percentile(ptp, 0.5), "x"),
        Figure("PTP duration over Ruckig's, largest", max(ptp), "x"),
    ]


def _planning_us(plan: Plan) -> float:
    """The best of a few: what it costs, not what else the machine does."""
    taken = []
    for _ in range(5):
        began = thread_time()
        chain_of(plan)
        taken.append(thread_time() - began)
    return 1e6 * min(taken)
