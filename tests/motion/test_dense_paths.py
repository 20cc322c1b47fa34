"""Dense paths: many short lines take no longer than they took the planner before, whenever they are sent."""

import pytest

from benchmarks.dense_paths import before, joints_along
from tests.stepped import SteppedRobot, assert_within_limits

SAMPLE = 23  # every one of so many; all of them are in `make bench ARGS=dense`
TINY = "circle of 0.5 mm lines at 1"  # a KR 6 once stopped at each of these, and took three times as long
SLOW = "circle of 2 mm lines at 0.02"  # an iiwa 14 stopped on it, as no clock was found that kept velocities
FOUR = "polyline of 2 mm, 10 deg, R = L/2"  # 8 mm ahead were once less than it went while a plan was made
NAMED = (
    ("kr_6_r900_sixx", TINY, "at once"),
    ("lbr_iiwa_14_r820", SLOW, "at once"),
    ("lbr_iiwa_7_r800", FOUR, "as four wait"),
)
RUNS = list(before())


@pytest.mark.slow
@pytest.mark.requirement("FRC015")
@pytest.mark.parametrize(
    ("robot", "path", "feed", "ticks"),
    [*(run for run in RUNS if run[:3] in NAMED), *RUNS[::SAMPLE]],
)
def test_a_dense_path_takes_no_longer_than_before_and_keeps_its_limits(
    robot: str, path: str, feed: str, ticks: int
) -> None:
    joints = joints_along(robot, path, feed)
    assert len(joints) - 1 <= ticks + 1
    recorded = SteppedRobot(robot)
    recorded.joints = list(map(tuple, joints.tolist()))
    recorded.stopping = recorded.direct = [False] * len(joints)
    assert_within_limits(recorded)
