"""Checks for every sequence of moves with blending."""

from __future__ import annotations

import numpy as np

from tests.blended_path import HALF, Joints, Places, Run
from tests.sequences import Recorder
from tests.stepped import Array, assert_within_limits

STOP_S = 0.1
RELATIVE_SPEED_TOLERANCE = 1.002  # of relative speeds, where they change in a blend


def assert_keeps_all_promises(recorder: Recorder) -> None:
    assert_within_limits(recorder.robot)
    for run in recorder.runs:
        assert_keeps_its_paths(run)
        assert_keeps_its_speeds(run)
        assert_rests_at_exact_targets(run)


def assert_keeps_its_paths(run: Run) -> None:
    """Exact paths outside the regions of blending, in order; at the end exactly at the target, or stopped."""
    assert run.places.possible.any(axis=1).all()
    if run.stopped_at is None:
        assert run.robot.joints[run.last] == run.moves[-1].corner
    else:
        assert (run.last - run.stopped_at) * run.robot.tick_s <= STOP_S + 1e-9


def assert_keeps_its_speeds(run: Run) -> None:
    """No joint is faster than its relative speed of the move, or where it blends of the faster one."""
    caps = run.places.speed_caps()
    caps = np.maximum(caps[1:], caps[:-1]) * run.robot.description.velocity
    velocities = np.abs(np.diff(run.ticks.q, axis=0)) / run.robot.tick_s
    beyond = velocities - caps * RELATIVE_SPEED_TOLERANCE
    k, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
    assert beyond.max() <= 1e-9, (
        f"joint {joint} runs {velocities[k, joint] / caps[k, joint]:.6f} times too fast at tick {k}, "
        f"places {np.flatnonzero(run.places.possible[k]).tolist()}"
    )


def assert_rests_at_exact_targets(run: Run) -> None:
    """Without blending the joints come to the target, and are at rest there."""
    for i, move in enumerate(run.moves[:-1]):
        if move.blending_mm == 0.0 and not move.blends_in_joints and run.places.passed(i):
            assert comes_to_rest_at(run, move.corner), f"the robot does not rest at corner {i}"


def comes_to_rest_at(run: Run, corner: Joints) -> bool:
    """Return True if some tick is as near to a corner as after a rest there within a tick."""
    return bool((np.abs(run.ticks.q - corner) <= _crept(run) * 1.05 + 1e-9).all(axis=1).any())


def least_speed_at(run: Run, corner: int) -> float:
    """Return the least motion of the joints in a tick round a corner, over twice that next to a rest."""
    region = np.flatnonzero(_inside(run, corner) & run.places.at(corner))
    if len(region) == 0:  # passed within a tick
        return np.inf
    steps = _steps(run)[max(region[0] - 1, 0) : region[-1] + 1]
    return float(steps.min()) / 2.0


def _inside(run: Run, corner: int) -> Array:
    """Ticks (m,) in the region round a corner; of a move that never leaves it only the half at the corner."""
    places: Places = run.places
    before = places.possible[:, 2 * corner] & (places.s[:, corner] < HALF)
    after = places.possible[:, 2 * corner + 2] & (places.s[:, corner + 1] > HALF)
    return (places.offset[:, corner] <= places.radius[corner]) & ~before & ~after


def _steps(run: Run) -> Array:
    """Return the motion of the joints from each tick to the next (m - 1,), over that next to a rest."""
    return (np.abs(np.diff(run.ticks.q, axis=0)) / _crept(run)).max(axis=1)


def _crept(run: Run) -> Array:
    """Return the distance that each joint can go in one tick from rest (n,)."""
    return np.array(run.robot.description.jerk) * run.robot.tick_s**3 / 6.0
