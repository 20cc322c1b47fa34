"""Blending: what a corner looks like, and when there is one."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from tests.asked import lin_joint_move, ptp_move
from tests.blended_path import Run
from tests.chain_checks import (
    assert_keeps_all_promises,
    assert_keeps_its_paths,
    comes_to_rest_at,
    least_speed_at,
)
from tests.chains import UNTIL_STOPPED, Recorder
from tests.stepped import ARMS, TOLERANCE, Array, SteppedRobot, assert_within_limits, worst_loads

SIDE_MM = 200.0
SIDE = 4  # points of a cube


HOMES = {
    "lbr_iiwa_7_r800": (0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0),
    "kr_6_r900_sixx": (0.0, -1.5, 1.6, 0.0, 1.4, 0.0),
}
both = pytest.mark.parametrize("name", ARMS)
names = st.sampled_from(ARMS)


def at_start(name: str) -> Recorder:
    """A robot with room for a square in front of it."""
    return Recorder(replace(load_robot(name), home=HOMES[name]))


def square(name: str, blending_mm: float, waits: tuple[int, ...] = (0, 0, 0)) -> Recorder:
    recorder = at_start(name)
    for (y_mm, z_mm), wait in zip(
        ((SIDE_MM, 0.0), (0.0, -SIDE_MM), (-SIDE_MM, 0.0), (0.0, SIDE_MM)), (*waits, 0), strict=True
    ):
        recorder.lin(0.0, y_mm, z_mm, blending_mm)
        recorder.wait(wait)
    recorder.finish()
    return recorder


def tcp_speeds(run: Run) -> Array:
    """m/s, from each tick to the next (m - 1,)."""
    return np.linalg.norm(np.diff(run.ticks.p, axis=0), axis=1) / run.robot.tick_s


def cut_m(run: Run, corner: int) -> float:
    """How far from a corner the TCP passes at least."""
    end = run.robot.tcp(run.moves[corner].corner).translation
    return float(np.linalg.norm(run.ticks.p - end, axis=1).min())


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_the_corners_of_a_square_are_passed_at_speed_within_their_spheres(name: str) -> None:
    recorder = square(name, 30.0)
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    for corner in range(3):
        assert least_speed_at(run, corner) > 10.0
        assert 1e-5 < cut_m(run, corner) < 0.03
    assert recorder.ticks() < 0.95 * recorder.ticks(blending=False)


@pytest.mark.requirement("FRC012")
@both
def test_larger_radii_take_less_time(name: str) -> None:
    ticks = [square(name, radius_mm).tick for radius_mm in (0.0, 5.0, 20.0, 60.0)]
    assert all(larger < 1.01 * smaller for smaller, larger in pairwise(ticks))
    assert ticks[-1] < 0.95 * ticks[0]


@pytest.mark.requirement("FRC012")
@both
def test_a_radius_past_half_of_a_move_is_clipped_to_half(name: str) -> None:
    clipped, half = square(name, 500.0), square(name, SIDE_MM / 2.0)
    assert_keeps_all_promises(clipped)
    np.testing.assert_allclose(clipped.robot.joints, half.robot.joints, atol=1e-6)
    assert min(cut_m(clipped.runs[0], corner) for corner in range(3)) < SIDE_MM / 2000.0


@pytest.mark.requirement("FRC012")
@both
def test_without_blending_the_robot_rests_at_each_target(name: str) -> None:
    recorder = square(name, 0.0)
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    assert all(comes_to_rest_at(run, move.corner) for move in run.moves)


@pytest.mark.requirement("FRC012", "FRC015")
@pytest.mark.parametrize(("name", "speed_rel"), [(ARMS[0], 0.3), (ARMS[1], 0.2)])
def test_lines_in_one_direction_go_on_at_full_speed(name: str, speed_rel: float) -> None:
    whole, parted = at_start(name), at_start(name)
    whole.lin(0.0, 300.0, 0.0, 0.0, speed_rel)
    whole.finish()
    for _ in range(2):
        parted.lin(0.0, 150.0, 0.0, 30.0, speed_rel)
    parted.finish()
    assert_keeps_all_promises(parted)
    assert parted.tick <= 1.05 * whole.tick
    (run,) = parted.runs
    speeds = tcp_speeds(run)
    inside = np.flatnonzero(run.places.offset[:, 0] <= 0.03)
    before, after = speeds[inside[0] - 1], speeds[inside[-1] + 1]
    assert speeds[inside[0] : inside[-1]].min() > 0.95 * min(before, after)


@pytest.mark.requirement("FRC015")
@pytest.mark.parametrize("name", [ARMS[0], pytest.param(ARMS[1], marks=pytest.mark.slow)])
def test_a_chain_of_short_moves_runs_steadily(name: str) -> None:
    """As from a CAM program: moves of 2 mm along a circle, blended by 1 mm."""
    recorder = at_start(name)
    count = 100
    radius_mm = 2.0 * count / (2.0 * np.pi)
    angles = np.linspace(0.0, 2.0 * np.pi, count + 1)
    circle = radius_mm * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    for y_mm, z_mm in np.diff(circle, axis=0).tolist():
        recorder.lin(0.0, y_mm, z_mm, 1.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    speeds = tcp_speeds(run)
    cruise = speeds[len(speeds) // 10 : -len(speeds) // 10]
    assert cruise.min() > 0.5 * np.median(cruise)
    assert recorder.ticks() < 0.3 * recorder.ticks(blending=False)


@pytest.mark.requirement("FRC014", "FRC015")
def test_a_cube_is_filled_line_by_line_without_stops() -> None:
    """In steps of 12 mm; a thousand moves of all kinds are in test_chain."""
    recorder = at_start(ARMS[0])
    for x_mm, y_mm, z_mm in np.diff(cube(SIDE, 12.0), axis=0).tolist():
        recorder.lin(x_mm, y_mm, z_mm, 4.0)
    recorder.finish()
    assert_within_limits(recorder.robot)
    (run,) = recorder.runs
    assert run.robot.joints[-1] == run.moves[-1].corner
    speeds: list[float] = []
    for part in run.parts(25):
        assert_keeps_its_paths(part)
        speeds += [least_speed_at(part, corner) for corner in range(len(part.moves) - 2)]
    assert len(speeds) > 0.8 * SIDE**3
    assert np.mean(np.array(speeds) > 1.0) > 0.99


def cube(side: int, pitch_mm: float) -> Array:
    """The points (side ** 3, 3) of a cube, each one beside the last (mm)."""
    places = []
    for x in range(side):
        for y in range(side)[:: -1 if x % 2 else 1]:
            forth = (x * side + y if x % 2 == 0 else x * side + side - 1 - y) % 2 == 0
            places += [(-x, y, -z) for z in range(side)[:: 1 if forth else -1]]
    return pitch_mm * np.array(places)


@pytest.mark.requirement("FRC015")
@both
def test_a_joint_move_blends_over_a_tenth_of_its_way(name: str) -> None:
    recorder = at_start(name)
    home = HOMES[name]
    for offsets in (
        (0.5, -0.3, 0.3, 0.3, 0.2, -0.3, 0.4),
        (-0.5, 0.1, 0.1, -0.1, 0.5, 0.0, -0.4),
        (0.0,) * 7,
    ):
        joints = tuple(np.add(home, offsets[: len(home)]).tolist())
        assert recorder.send("joint", joints, recorder.robot.tcp_frame(joints), (0.8,) * len(home), 0.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    assert run.places.radius == pytest.approx([0.05, 0.1])
    for corner in range(2):
        assert 1e-4 < run.places.offset[:, corner].min() <= run.places.radius[corner]
        assert least_speed_at(run, corner) > 10.0


@pytest.mark.requirement("FRC015")
@pytest.mark.parametrize("left_s", [0.6, 0.8])
@both
def test_a_move_that_comes_in_time_blends_with_the_one_under_way(name: str, left_s: float) -> None:
    """As long before the end of the move as it takes to stop from full speed, and to come to the sphere."""
    first = at_start(name)
    first.lin(0.0, 400.0, 0.0, 30.0, 0.4)
    first.finish()
    recorder = at_start(name)
    recorder.lin(0.0, 400.0, 0.0, 30.0, 0.4)
    recorder.wait(first.tick - 3 - round(left_s / recorder.robot.tick_s))
    recorder.lin(0.0, 0.0, -150.0, 30.0, 0.4)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert least_speed_at(recorder.runs[0], 0) > 10.0


@pytest.mark.requirement("FRC014", "FRC015")
@settings(phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(name=names, left=st.integers(-30, 330), following=st.sampled_from([0.05, 0.4, 1.0]))
def test_a_move_appended_at_any_time_keeps_all_promises_and_never_comes_later(
    name: str, left: int, following: float
) -> None:
    whole = at_start(name)
    whole.lin(0.0, 250.0, 0.0, 40.0, 1.0)
    whole.finish()
    recorder = at_start(name)
    recorder.lin(0.0, 250.0, 0.0, 40.0, 1.0)
    recorder.wait(max(whole.tick - 3 - left, 0))
    recorder.lin(0.0, 0.0, -150.0, 40.0, following)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert recorder.ticks() <= recorder.ticks(blending=False) + 1


@pytest.mark.slow
def test_accelerations_keep_their_limits_between_the_samples_of_a_blend() -> None:
    """From a slow move with a large radius into one that is five times as fast."""
    robot = SteppedRobot()
    robot.goes_to([-0.3416, -0.3656, 0.0, -1.4160, -0.5539, 1.5773, -0.9367])
    corner = robot.tcp_frame([-0.1722, -0.3838, 0.0, -1.1869, -0.6628, 1.8538, -0.9827])
    robot.controller.move(ptp_move(corner, 0.1, 500.0))
    robot.controller.move(ptp_move(Frame(80.476, -147.504, 836.308, 1.94159, -1.21079, -2.07595), 0.5, 0.0))
    robot.runs_until_stopped()
    assert worst_loads(robot)["acceleration"] <= TOLERANCE


@pytest.mark.slow
def test_no_acceleration_hides_between_the_samples_of_a_long_blend() -> None:
    """With 17 samples of a blend 3 % too much once did."""
    robot = SteppedRobot(replace(load_robot(), home=(0.993, 0.286, -0.248, -1.574, 0.096, 1.618, 0.114)))
    corner = (0.984, 0.916, -0.253, -0.507, 0.191, 1.832, 0.102)
    robot.controller.move(ptp_move(robot.tcp_frame(corner), 0.5, 500.0, corner[2]))
    robot.controller.move(lin_joint_move((1.011, 0.562, -0.122, -0.488, -0.058, 1.811, 0.887), 0.5, 0.0))
    robot.runs_until_stopped()
    assert worst_loads(robot)["acceleration"] <= TOLERANCE


@pytest.mark.requirement("FRC014")
@both
def test_a_move_that_comes_too_late_starts_from_rest_at_the_target(name: str) -> None:
    recorder = square(name, 30.0, waits=(UNTIL_STOPPED, UNTIL_STOPPED, UNTIL_STOPPED))
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    assert all(comes_to_rest_at(run, move.corner) for move in run.moves)


@pytest.mark.requirement("FRC003", "FRC013", "FRC016")
@settings(phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(name=names, after=st.integers(1, 700))
def test_a_stop_in_a_blend_keeps_the_path_and_the_next_moves_start_from_there(name: str, after: int) -> None:
    recorder, unstopped = at_start(name), square(name, 60.0)
    for y_mm, z_mm in ((SIDE_MM, 0.0), (0.0, -SIDE_MM), (-SIDE_MM, 0.0), (0.0, SIDE_MM)):
        recorder.lin(0.0, y_mm, z_mm, 60.0)
    recorder.wait(after)
    recorder.stop()
    stopped = recorder.runs[-1].start
    # It rests on the path that it would have gone on: no farther from two of its ticks than these are apart.
    q = np.array(unstopped.robot.joints)
    steps = np.linalg.norm(np.diff(q, axis=0), axis=1)
    off = np.linalg.norm(q - stopped, axis=1)
    detours = off[1:] + off[:-1] - steps
    assert detours.min() < 1e-6 + 1e-3 * steps.max()
    recorder.wait(20)
    recorder.lin(50.0, 0.0, 0.0, 20.0)
    recorder.lin(0.0, 50.0, 0.0, 20.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
