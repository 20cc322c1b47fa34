"""The checks of chains find what is wrong: recordings are falsified by hand."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace

import numpy as np
import pytest

from iiwa_sim.robot.description import load_robot
from tests.blended_path import Joints, Run
from tests.chain_checks import (
    assert_keeps_its_paths,
    assert_keeps_its_speeds,
    assert_rests_at_exact_targets,
)
from tests.chains import Recorder

RADIUS_MM = 30.0


def found_off_its_path(found: bool = True) -> AbstractContextManager[object]:
    return pytest.raises(AssertionError, match="tolerances off moves") if found else nullcontext()


def exact_run(kind: str = "lin", speed_rel: float = 0.2) -> Run:
    """Three moves round corners, each resting at its target."""
    recorder = Recorder(load_robot())
    for x_mm, y_mm, z_mm in ((0.0, 150.0, 0.0), (-150.0, 0.0, 0.0), (0.0, 0.0, 150.0)):
        frame = recorder.scout.controller.tool_frame()
        frame = frame._replace(x_mm=frame.x_mm + x_mm, y_mm=frame.y_mm + y_mm, z_mm=frame.z_mm + z_mm)
        assert recorder.send(kind, recorder.end, frame, (speed_rel,) * 7, 0.0)
    recorder.finish()
    (run,) = recorder.runs
    return run


def falsified(run: Run, joints: Sequence[Joints], blending_mm: float = 0.0) -> Run:
    """The moves of a run with other ticks and another radius."""
    run.robot.joints = list(joints)
    moves = [replace(move, blending_mm=blending_mm) for move in run.moves]
    return Run(run.robot, 0, run.start, moves, len(joints) - 1)


def ticks_of(run: Run) -> list[Joints]:
    return run.robot.joints[run.first : run.last + 1]


def corner_distances(run: Run, corner: int) -> np.ndarray:
    end = run.robot.tcp(run.moves[corner].corner).translation
    return np.linalg.norm(run.ticks.p - end, axis=1)


def with_rounded_corner(run: Run, cut_m: float) -> list[Joints]:
    """The ticks of the run, but leaving the path that far before the first corner and back on it after it."""
    near = np.flatnonzero(corner_distances(run, 0) < cut_m)
    first, last = int(near[0]), int(near[-1])
    joints = ticks_of(run)
    a, b, c = np.array(joints[first]), np.array(run.moves[0].corner), np.array(joints[last])
    for k in range(first, last):
        x = (k - first) / (last - first)
        joints[k] = tuple(((1.0 - x) ** 2 * a + 2.0 * x * (1.0 - x) * b + x**2 * c).tolist())
    return joints


@pytest.mark.parametrize("kind", ["lin", "ptp"])
@pytest.mark.parametrize(("off_m", "fine"), [(0.2e-6, True), (2e-6, False)])
def test_a_tick_2_um_off_the_path_is_found(kind: str, off_m: float, fine: bool) -> None:
    run = exact_run(kind)
    joints = ticks_of(run)
    k = int(np.flatnonzero(corner_distances(run, 0) > 0.08)[-1] // 2)
    along = run.ticks.p[k + 1] - run.ticks.p[k - 1]
    aside = np.cross(along, [0.3, 0.5, 0.8])
    aside *= off_m / np.linalg.norm(aside)
    jacobian = run.robot.model.jacobian(joints[k])
    tool = run.ticks.p[k] - np.array(run.robot.model.flange(joints[k]).translation)
    at_tcp = jacobian[:3] + np.cross(jacobian[3:].T, tool).T
    joints[k] = tuple(
        (np.array(joints[k]) + np.linalg.pinv(np.vstack([at_tcp, jacobian[3:]])) @ [*aside, 0, 0, 0]).tolist()
    )
    with found_off_its_path(not fine):
        assert_keeps_its_paths(falsified(run, joints))


@pytest.mark.parametrize("kind", ["lin", "ptp"])
@pytest.mark.parametrize(("part", "fine"), [(0.95, True), (1.05, False)])
def test_a_sphere_left_by_5_percent_is_found(kind: str, part: float, fine: bool) -> None:
    run = exact_run(kind, 0.05)
    with found_off_its_path(not fine):
        assert_keeps_its_paths(falsified(run, with_rounded_corner(run, part * RADIUS_MM / 1000.0), RADIUS_MM))


def test_an_exact_target_that_is_not_rested_at_is_found() -> None:
    run = exact_run()
    away = corner_distances(run, 1) > 2e-4
    hurried = [q for q, far in zip(ticks_of(run), away, strict=True) if far]
    assert len(hurried) < len(ticks_of(run))
    wrong = falsified(run, hurried)
    with pytest.raises(AssertionError, match="does not rest at corner 1"):
        assert_rests_at_exact_targets(wrong)


def test_too_fast_a_tick_is_found() -> None:
    run = exact_run(speed_rel=1.0)
    middle = int(corner_distances(run, 0).argmin() // 2)
    joints = ticks_of(run)
    slow = falsified(run, joints)
    slow.moves = [replace(move, speeds_rel=(0.99 * float(slow_speed(run)),) * 7) for move in run.moves]
    with pytest.raises(AssertionError, match="times too fast"):
        assert_keeps_its_speeds(slow)
    del joints[middle]
    with pytest.raises(AssertionError, match="times too fast"):
        assert_keeps_its_speeds(falsified(run, joints))


def slow_speed(run: Run) -> float:
    """The largest relative speed of any joint in a run."""
    velocities = np.abs(np.diff(run.ticks.q, axis=0)) / run.robot.tick_s
    return float((velocities / run.robot.description.velocity).max())
