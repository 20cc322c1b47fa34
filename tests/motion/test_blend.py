"""Blending: corners, sequences of moves of every kind, and moves appended at any time."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from iiwa_sim.robot.description import load_robot
from tests.blended_path import Run
from tests.sequence_checks import (
    assert_keeps_all_promises,
    comes_to_rest_at,
    least_speed_at,
)
from tests.sequences import KINDS, ROOMY, Recorder, in_the_open, sequences
from tests.stepped import ALL_ROBOTS, ARMS, Array

SIDE_MM = 200.0
FRAME_KINDS = tuple(kind for kind in KINDS if kind != "joint")
# Shrinking a sequence takes minutes; the checks name the tick and the moves.
SETTINGS = settings(
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example],
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)
both = pytest.mark.parametrize("name", ARMS)
names = st.sampled_from(ARMS)


def square(name: str, blending_mm: float) -> Recorder:
    recorder = in_the_open(name)
    for y_mm, z_mm in ((SIDE_MM, 0.0), (0.0, -SIDE_MM), (-SIDE_MM, 0.0), (0.0, SIDE_MM)):
        recorder.lin(0.0, y_mm, z_mm, blending_mm)
    recorder.finish()
    return recorder


def tcp_speeds(run: Run) -> Array:
    """m/s, from each tick to the next (m - 1,)."""
    return np.linalg.norm(np.diff(run.ticks.p, axis=0), axis=1) / run.robot.tick_s


def cut_m(run: Run, corner: int) -> float:
    """Return the least distance of the TCP from a corner."""
    end = run.robot.tcp(run.moves[corner].corner).translation
    return float(np.linalg.norm(run.ticks.p - end, axis=1).min())


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_a_square_is_blended_within_the_spheres_and_faster_with_larger_ones(name: str) -> None:
    squares = {radius_mm: square(name, radius_mm) for radius_mm in (0.0, 30.0, SIDE_MM / 2.0)}
    for radius_mm, recorder in squares.items():
        assert_keeps_all_promises(recorder)
        (run,) = recorder.runs
        for corner in range(3):
            if radius_mm == 0.0:
                assert comes_to_rest_at(run, run.moves[corner].corner)
            else:
                assert least_speed_at(run, corner) > 10.0
                assert 1e-5 < cut_m(run, corner) < radius_mm / 1000.0
    assert all(larger.tick < 0.97 * smaller.tick for smaller, larger in pairwise(squares.values()))
    clipped = square(name, 500.0)  # to half of each move: in the middle two spheres meet
    np.testing.assert_allclose(clipped.robot.joints, squares[SIDE_MM / 2.0].robot.joints, atol=1e-6)


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_very_short_moves_between_long_ones_are_no_slower_than_stops(name: str) -> None:
    recorder = in_the_open(name)
    recorder.lin(0.0, 100.0, 0.0, 20.0)
    recorder.lin(0.0, 0.0, 0.02, 20.0)
    recorder.lin(0.02, 0.0, 0.0, 20.0)
    recorder.lin(0.0, -100.0, 0.0, 20.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert recorder.ticks() <= 1.005 * recorder.ticks(blending=False) + 1


@pytest.mark.requirement("FRC012", "FRC015")
@pytest.mark.parametrize(("name", "speed_rel"), [(ARMS[0], 0.3), (ARMS[1], 0.2)])
def test_lines_in_one_direction_continue_at_full_speed(name: str, speed_rel: float) -> None:
    whole, parted = in_the_open(name), in_the_open(name)
    whole.lin(0.0, 300.0, 0.0, 0.0, speed_rel)
    whole.finish()
    for _ in range(2):
        parted.lin(0.0, 150.0, 0.0, 30.0, speed_rel)
    parted.finish()
    assert_keeps_all_promises(parted)
    assert parted.tick <= 1.05 * whole.tick


@pytest.mark.requirement("FRC015")
def test_a_blended_sequence_of_short_moves_runs_steadily() -> None:
    """Moves of 2 mm along half a circle, blended by 1 mm, like those of a CAM program."""
    recorder = in_the_open(ARMS[0])
    angles = np.linspace(0.0, np.pi, 51)
    circle = 100.0 / np.pi * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    for y_mm, z_mm in np.diff(circle, axis=0).tolist():
        recorder.lin(0.0, y_mm, z_mm, 1.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    speeds = tcp_speeds(run)
    cruise = speeds[len(speeds) // 5 : -len(speeds) // 5]
    assert cruise.min() > 0.5 * np.median(cruise)
    assert recorder.ticks() < 0.3 * recorder.ticks(blending=False)


@pytest.mark.requirement("FRC015")
@both
def test_a_joint_move_blends_over_a_tenth_of_its_distance(name: str) -> None:
    recorder = in_the_open(name)
    home = ROOMY[name]
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


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_joint_moves_along_a_position_limit_blend_and_keep_the_limit(name: str) -> None:
    """Two moves add up to more than either in a corner; the sum stays within the limits."""
    recorder = in_the_open(name)
    d = recorder.robot.description
    for part, wrist in ((1.0, 0.3), (0.97, -0.3), (1.0, 0.2)):
        joints = np.array(ROOMY[name])
        joints[0] = part * d.position_max[0]
        joints[-1] = part * d.position_min[-1]
        joints[3] += wrist
        to = tuple(joints.tolist())
        assert recorder.send("joint", to, recorder.robot.tcp_frame(to), (1.0,) * len(to), 0.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    assert not any(comes_to_rest_at(run, move.corner) for move in run.moves[:-1])


@pytest.mark.requirement("FRC014", "FRC015")
@settings(phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(name=names, left=st.integers(-30, 330), following=st.sampled_from([0.05, 0.4, 1.0]))
def test_a_move_appended_at_any_time_keeps_paths_and_limits_and_ends_no_later(
    name: str, left: int, following: float
) -> None:
    whole = in_the_open(name)
    whole.lin(0.0, 250.0, 0.0, 40.0)
    whole.finish()
    recorder = in_the_open(name)
    recorder.lin(0.0, 250.0, 0.0, 40.0)
    recorder.wait(max(whole.tick - 3 - left, 0))
    recorder.lin(0.0, 0.0, -150.0, 40.0, following)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert recorder.ticks() <= recorder.ticks(blending=False) + 1
    if left > 300:  # as long as it takes to stop from full speed, and to come to the sphere
        assert least_speed_at(recorder.runs[0], 0) > 10.0
    if left < 0:
        assert comes_to_rest_at(recorder.runs[0], recorder.runs[0].moves[0].corner)


@pytest.mark.requirement("FRC003", "FRC013", "FRC016")
@settings(phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(name=names, after=st.integers(1, 700))
def test_a_stop_in_a_blend_keeps_the_path_and_the_next_moves_start_from_there(name: str, after: int) -> None:
    recorder, unstopped = in_the_open(name), square(name, 60.0)
    for y_mm, z_mm in ((SIDE_MM, 0.0), (0.0, -SIDE_MM), (-SIDE_MM, 0.0), (0.0, SIDE_MM)):
        recorder.lin(0.0, y_mm, z_mm, 60.0)
    recorder.wait(after)
    recorder.stop()
    stopped = recorder.runs[-1].start
    # It rests between two ticks of the path that it would have gone on.
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


# Sequences of random moves


def recorded(sequence: list[Any], name: str, tick_s: float = 0.002) -> Recorder:
    recorder = Recorder(load_robot(name), tick_s)
    recorder.run(sequence)
    return recorder


def sequences_of(name: str, **kind: Any) -> st.SearchStrategy[list[Any]]:
    return sequences(len(load_robot(name).joints), **kind)


@pytest.mark.requirement("FRC002", "FRC006", "FRC012", "FRC014", "FRC015")
@pytest.mark.parametrize("name", ALL_ROBOTS)
@SETTINGS
@given(data=st.data())
def test_sequences_sent_at_once_keep_paths_and_limits_and_are_no_slower_than_stops(
    name: str, data: st.DataObject
) -> None:
    recorder = recorded(data.draw(sequences_of(name, kinds=FRAME_KINDS, at_once=True)), name)
    assert_keeps_all_promises(recorder)
    assert recorder.ticks() <= 1.005 * recorder.ticks(blending=False) + 1


@pytest.mark.requirement("FRC003", "FRC005", "FRC012", "FRC013", "FRC014", "FRC015", "FRC016", "FRC025")
@SETTINGS
@given(data=st.data(), name=names, rate_hz=st.sampled_from([100, 250, 500, 1000]))
def test_sequences_keep_paths_and_limits_when_stopped_or_changed_in_mid_motion(
    data: st.DataObject, name: str, rate_hz: int
) -> None:
    """Moves of all kinds, and at any time between them stops and overrides.

    With HYPOTHESIS_PROFILE=hunt this hunts for faults of the planner.
    """
    sequence = data.draw(sequences_of(name, stops=True, overrides=True))
    assert_keeps_all_promises(recorded(sequence, name, 1.0 / rate_hz))
