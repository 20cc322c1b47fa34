"""Corners with hardly any room: at limits of positions, between very short moves, in spheres that meet."""

from dataclasses import replace

import numpy as np
import pytest

from iiwa_sim.robot.description import load_robot
from tests.chain_checks import assert_keeps_all_promises, comes_to_rest_at
from tests.chains import Recorder
from tests.stepped import ARMS

both = pytest.mark.parametrize("name", ARMS)
HOMES = {
    "lbr_iiwa_7_r800": (0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0),
    "kr_6_r900_sixx": (0.0, -1.5, 1.6, 0.0, 1.4, 0.0),
}


def recorder_of(name: str, tick_s: float = 0.002) -> Recorder:
    return Recorder(replace(load_robot(name), home=HOMES[name]), tick_s)


def send_joints(recorder: Recorder, joints: tuple[float, ...], speed_rel: float = 1.0) -> None:
    frame = recorder.robot.tcp_frame(joints)
    assert recorder.send("joint", joints, frame, (speed_rel,) * len(joints), 0.0)


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_joint_moves_along_a_position_limit_blend_in_their_zones_and_keep_the_limit(name: str) -> None:
    """To and fro between targets right at limits: what two moves add up to in a corner stays within them."""
    recorder = recorder_of(name)
    d = recorder.robot.description
    highest, lowest = np.array(d.position_max), np.array(d.position_min)
    for part, wrist in ((1.0, 0.3), (0.97, -0.3), (1.0, 0.2), (0.98, 0.3)):
        joints = np.array(HOMES[name])
        joints[0] = part * highest[0]
        joints[-1] = (1.0 - part) * 10.0 * lowest[-1] + part * lowest[-1] * (part == 1.0)
        joints[3] += wrist
        send_joints(recorder, tuple(joints.tolist()))
    recorder.finish()
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    assert not any(comes_to_rest_at(run, move.corner) for move in run.moves[:-1])


@pytest.mark.requirement("FRC012", "FRC015")
@pytest.mark.parametrize("way_mm", [0.02])
@both
def test_very_short_moves_between_long_ones_are_no_slower_than_stops(name: str, way_mm: float) -> None:
    recorder = recorder_of(name)
    recorder.lin(0.0, 100.0, 0.0, 20.0)
    recorder.lin(0.0, 0.0, way_mm, 20.0)
    recorder.lin(way_mm, 0.0, 0.0, 20.0)
    recorder.lin(0.0, -100.0, 0.0, 20.0)
    recorder.lin(0.0, 0.0, way_mm, 20.0)
    recorder.lin(0.0, 0.0, 100.0, 0.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert recorder.ticks() <= 1.005 * recorder.ticks(blending=False) + 1


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_where_spheres_meet_the_robot_goes_from_one_corner_into_the_next(name: str) -> None:
    """Radii beyond half of each move: nothing is left of its path but the point in which two spheres meet."""
    recorder = recorder_of(name)
    for y_mm, z_mm in ((60.0, 0.0), (0.0, -60.0), (60.0, 0.0), (0.0, -60.0), (60.0, 0.0)):
        recorder.lin(0.0, y_mm, z_mm, 500.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    (run,) = recorder.runs
    assert not any(comes_to_rest_at(run, move.corner) for move in run.moves[:-1])
    assert recorder.ticks() < 0.8 * recorder.ticks(blending=False)
