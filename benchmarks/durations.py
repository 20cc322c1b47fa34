"""How long moves take, over the time-optimum along the same path."""

from benchmarks.figures import Figure, percentile
from benchmarks.lines import random_joint_lines, random_lines
from benchmarks.time_optimal import fastest_without_jerk_limit_s, ruckig_s
from iiwa_sim.robot.description import load_robot

MOVES = 50


def measure() -> list[Figure]:
    """Durations of 50 random lines and 50 random joint moves of the default robot."""
    robot = load_robot()
    lines = list(random_lines(robot, MOVES, seed=1))
    joint_lines = list(random_joint_lines(robot, MOVES, seed=1))
    lin = [plan.timing.duration_s / fastest_without_jerk_limit_s(plan.path, robot) for plan in lines]
    ptp = [plan.timing.duration_s / ruckig_s(plan.path, robot) for plan in joint_lines]
    return [
        Figure(
            "LIN duration over time-optimal without jerk limit, median",
            percentile(lin, 0.5),
            "x",
            at_most=1.25,
        ),
        Figure("LIN duration over time-optimal without jerk limit, p95", percentile(lin, 0.95), "x"),
        Figure("PTP duration over Ruckig's, median", percentile(ptp, 0.5), "x"),
        Figure("PTP duration over Ruckig's, largest", max(ptp), "x"),
    ]
