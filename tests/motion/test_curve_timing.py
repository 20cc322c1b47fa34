"""The timing of curves, on lines as the robot runs them."""

import numpy as np
import pytest

from benchmarks.lines import random_lines
from benchmarks.time_optimal import fastest_without_jerk_limit_s
from iiwa_sim.robot.description import load_robot


@pytest.mark.requirement("FRC009")
def test_lines_take_little_more_than_the_time_optimal_without_jerk_limit() -> None:
    description = load_robot()
    ratios = [
        plan.timing.duration_s / fastest_without_jerk_limit_s(plan.path, description)
        for plan in random_lines(description, count=50, seed=7)
    ]
    assert min(ratios) > 1.0
    assert np.median(ratios) < 1.15
    assert np.percentile(ratios, 95) < 1.25
