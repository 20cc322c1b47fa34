"""LIN: straight at every tick, calm at singular poses, and refused where it cannot be done."""

import re
from dataclasses import replace
from math import acos, atan2, cos, hypot, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import CROSSING_SINGULARITY, Refused
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.nearest import JOINT_LIMIT, OUT_OF_REACH, ROBOT_CONFIGURATION
from tests.requests import lin_joint_move, lin_move, ptp_move
from tests.samples import MANY
from tests.stepped import ALL_ROBOTS, ARMS, SteppedRobot, assert_straight, assert_within_limits

IIWA, KR6 = ARMS
CODES = {None, OUT_OF_REACH, JOINT_LIMIT, CROSSING_SINGULARITY, ROBOT_CONFIGURATION}
LINES = 30 if MANY else 3
STRETCHED = atan2(35.0, 420.0)
"""A3 of the KR 6 where its wrist is farthest from A2."""


def goes_straight_to(robot: SteppedRobot, target: Frame, speed_rel: float = 1.0) -> None:
    """Run a LIN and check every tick of it."""
    first = len(robot.joints) - 1
    robot.controller.move(lin_move(target, speed_rel, 0.0))
    robot.runs_until_stopped()
    assert_straight(robot, robot.joints[first:], target)
    assert_within_limits(robot)


def refusal(robot: SteppedRobot, target: Frame, speed_rel: float = 1.0) -> int | None:
    """Return the code of a rejected LIN; None for one that runs, and check that it is straight."""
    try:
        goes_straight_to(robot, target, speed_rel)
    except Refused as refused:
        assert not robot.controller.moving
        return refused.code
    return None


@pytest.mark.requirement("FRC009", "FRC005")
@pytest.mark.parametrize("name", ARMS)
@given(
    start=st.tuples(*[st.floats(-0.3, 0.3)] * 7),
    shift=st.tuples(*[st.floats(-250, 250)] * 3).filter(lambda shift: np.linalg.norm(shift) > 1.0),
    turn=st.tuples(*[st.floats(-0.6, 0.6)] * 3),
    speed_rel=st.sampled_from([1.0, 0.5, 0.1]),
)
def test_the_tcp_moves_straight_and_turns_on_the_shortest_arc(
    name: str, start: tuple[float, ...], shift: tuple[float, ...], turn: tuple[float, ...], speed_rel: float
) -> None:
    robot = SteppedRobot(name)
    home = robot.description.home
    robot.goes_to(np.add(home, start[: len(home)]).tolist())
    target = Frame(*np.add(robot.controller.tool_frame(), (*shift, *turn)))
    assert refusal(robot, target, speed_rel) in CODES


@pytest.mark.requirement("FRC009")
@pytest.mark.parametrize("name", ALL_ROBOTS)
def test_long_lines_from_anywhere_are_straight_and_keep_all_limits(name: str) -> None:
    rng, d, done = np.random.default_rng(99), load_robot(name), 0
    while done < LINES:
        start = 0.8 * rng.uniform(d.position_min, d.position_max)
        robot = SteppedRobot(replace(d, home=tuple(start.tolist())))
        shift, turn = rng.normal(size=(2, 3))
        shift *= rng.uniform(200.0, 600.0) / np.linalg.norm(shift)
        turn *= rng.uniform(0.0, 1.0) / np.linalg.norm(turn)
        target = Frame(*np.add(robot.controller.tool_frame(), (*shift, *turn)).tolist())
        done += refusal(robot, target) is None


@pytest.mark.requirement("FRC009")
def test_a3_is_kept_without_a_redundancy_and_moves_evenly_with_one() -> None:
    robot = SteppedRobot()
    target = robot.controller.tool_frame()._replace(y_mm=150.0)
    goes_straight_to(robot, target)
    assert np.ptp([q[2] for q in robot.joints]) == 0.0
    robot.controller.move(lin_move(target._replace(y_mm=-150.0), 1.0, 0.0, 0.4))
    first = len(robot.joints)
    robot.runs_until_stopped()
    parts = np.array([q[2] for q in robot.joints[first:]]) / 0.4
    places = np.array([robot.tcp_frame(q).y_mm for q in robot.joints[first:]])
    np.testing.assert_allclose(places, 150.0 - 300.0 * parts, atol=1e-6)


def test_a_line_in_the_plane_of_the_arm_passes_the_stretched_wrist() -> None:
    robot = SteppedRobot()
    robot.goes_to(tuple(map(radians, (0, 25, 0, 90, 0, 0, 0))))
    frame = robot.controller.tool_frame()
    goes_straight_to(robot, frame._replace(z_mm=frame.z_mm + 60.0))
    side = robot.controller.joints[5]
    goes_straight_to(robot, frame._replace(z_mm=frame.z_mm - 60.0))
    assert robot.controller.joints[5] * side < 0.0
    assert max(abs(q[4]) for q in robot.joints) < 1e-9


def above_a1(a3: float) -> tuple[float, float]:
    """A2 and A3 of the KR 6 with which its wrist point is on the axis of A1."""
    bend, fore = a3 - STRETCHED, hypot(0.42, 0.035)
    x, z = 0.455 + fore * cos(bend), -fore * sin(bend)
    return atan2(z, x) - acos(-0.025 / hypot(x, z)), a3


SINGULAR = {
    "straight up": (IIWA, (0.0,) * 7),
    "stretched iiwa": (IIWA, (0.3, 0.6, 0.2, 0.0, 0.1, 0.4, 0.0)),
    "wrist of an iiwa above A1": (IIWA, (0.4, 0.5, 0.0, 1.0 - 1e-9, 0.2, 0.7, 0.1)),
    "forearm sideways": (IIWA, tuple(map(radians, (30, 0, 90, 90, 30, -60, -60)))),
    "stretched": (KR6, (0.3, -0.9, STRETCHED, 0.2, 0.6, 0.1)),
    "nearly stretched": (KR6, (-0.5, -0.6, STRETCHED + 1e-9, 0.4, 0.9, -0.3)),
    "wrist above A1": (KR6, (0.4, *above_a1(1.2), 0.3, 0.7, 0.1)),
    "wrist nearly above A1": (KR6, (0.4, *above_a1(1.2 + 1e-8), 0.3, 0.7, 0.1)),
}


@pytest.mark.parametrize("pose", SINGULAR)
def test_lines_from_or_to_poses_that_no_line_can_leave_are_refused(pose: str) -> None:
    name, joints = SINGULAR[pose]
    robot = SteppedRobot(name)
    home = robot.controller.tool_frame()
    singular = robot.tcp_frame(joints)
    assert refusal(robot, singular) is not None
    robot.goes_to(joints)
    for target in (home, singular._replace(x_mm=singular.x_mm + 50.0, z_mm=singular.z_mm - 100.0)):
        for redundancy in (None, 1.2) if robot.redundant else (None,):
            with pytest.raises(Refused, match="singular") as refused:
                robot.controller.move(lin_move(target, 1.0, 0.0, redundancy))
            assert refused.value.code == CROSSING_SINGULARITY


@given(
    family=st.sampled_from(["stretched wrist of an iiwa", "stretched wrist", "stretched", "above A1"]),
    off=st.sampled_from([0.0, 1e-12, 1e-9, -1e-6, 1e-4, -1e-3, 1e-2, -5e-2]),
    seed=st.integers(0, 2**32 - 1),
    towards=st.booleans(),
    speed_rel=st.sampled_from([1.0, 0.1]),
)
def test_lines_near_singular_poses_are_straight_and_calm_or_refused(
    family: str, off: float, seed: int, towards: bool, speed_rel: float
) -> None:
    robot = SteppedRobot(IIWA if "iiwa" in family else KR6)
    d, rng = robot.description, np.random.default_rng(seed)
    q = np.array(d.home) + rng.uniform(-0.6, 0.6, len(d.home))
    if family == "stretched":
        q[2] = STRETCHED + off
    elif family == "above A1":
        q[1:3] = above_a1(q[2])
        q[1] += off
    else:
        q[-2] = off
    q = np.clip(q, d.position_min, d.position_max)
    beside = np.clip(q + rng.uniform(-0.3, 0.3, len(q)), d.position_min, d.position_max)
    if robot.redundant:
        beside[2] = q[2]
    start, end = (beside, q) if towards else (q, beside)
    robot.goes_to(start.tolist())
    assert refusal(robot, robot.tcp_frame(end.tolist()), speed_rel) in CODES


def test_a_line_to_joints_on_another_branch_names_the_singular_pose() -> None:
    robot = SteppedRobot()
    robot.goes_to((0.3, 0.6, 0.4, -1.3, 0.3, 0.9, -0.5))
    inverse, here = Inverse(robot.model), robot.controller.joints
    branches = {
        status: inverse.joints(robot.model.flange(here), here[2], status, here) for status in inverse.statuses
    }
    low, high = robot.description.position_min, robot.description.position_max
    del branches[inverse.status(here)]
    others = [q for q in branches.values() if q is not None and (np.clip(q, low, high) == q).all()]
    assert others
    for joints in others:
        reason = "a line to that pose ends in other joint positions, with the arm bent another way"
        with pytest.raises(Refused, match=reason) as refused:
            robot.controller.move(lin_joint_move(joints, 1.0, 0.0))
        assert refused.value.code == CROSSING_SINGULARITY


def test_a_joint_at_its_limit_may_not_swing_out_and_back_between_samples() -> None:
    robot = SteppedRobot()
    at_limit = (-2.2856853213636756, -0.931513223045174, -2.069896119293861, -0.3145630102617065)
    robot.goes_to((*at_limit, 1.296686193469328, 1.1439488728490401, -3.0543261909900767))
    target = Frame(391.6001405, 697.8269729, 486.0057214, -0.472484553, 0.321101595, -2.525937288)
    assert refusal(robot, target) == JOINT_LIMIT


@pytest.mark.parametrize("name", ARMS)
def test_lines_of_no_or_hardly_any_length_are_moves_too(name: str) -> None:
    robot = SteppedRobot(name)
    frame = robot.controller.tool_frame()
    robot.controller.move(lin_move(frame, 1.0, 0.0))
    assert robot.runs_until_stopped() == 1
    for length_mm in (1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 0.1):
        robot.controller.move(lin_move(frame._replace(x_mm=frame.x_mm + length_mm), 1.0, 0.0))
        robot.runs_until_stopped()
    assert robot.controller.tool_frame().x_mm == pytest.approx(frame.x_mm + 0.1)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC011")
@pytest.mark.parametrize("name", ARMS)
@given(offsets=st.tuples(*[st.floats(-0.3, 0.3)] * 7))
def test_a_line_to_joint_positions_ends_in_them(name: str, offsets: tuple[float, ...]) -> None:
    robot = SteppedRobot(name)
    home = robot.description.home
    target = tuple(np.add(home, offsets[: len(home)]).tolist())
    robot.controller.move(lin_joint_move(target, 1.0, 0.0))
    robot.runs_until_stopped()
    np.testing.assert_allclose(robot.controller.joints, target, atol=1e-6)
    assert_within_limits(robot)
    if np.linalg.norm(np.subtract(robot.tcp_frame(target)[:3], robot.tcp_frame(robot.joints[0])[:3])) > 1.0:
        assert_straight(robot, robot.joints, robot.tcp_frame(target))


@pytest.mark.requirement("FRC009")
@pytest.mark.parametrize("a6_deg", [-340, 170])
def test_a_joint_turns_continuously_beyond_half_a_turn(a6_deg: int) -> None:
    """Turning about the axis of A6: the inverse starts again at 180 deg, the joint does not."""
    robot = SteppedRobot(KR6)
    robot.goes_to([*robot.description.home[:5], radians(a6_deg)])
    turn_deg = -100.0 if a6_deg > 0 else 100.0
    for _ in range(2):
        here = robot.controller.joints
        turned = (*here[:5], here[5] + radians(turn_deg))
        end = robot.tcp_frame(turned)._replace(z_mm=robot.controller.tool_frame().z_mm + 20.0)
        goes_straight_to(robot, end)
        assert robot.controller.joints[5] == pytest.approx(turned[5], abs=1e-6)


def test_a_line_that_would_turn_a_joint_beyond_its_limit_is_refused() -> None:
    robot = SteppedRobot(KR6)
    robot.goes_to([*robot.description.home[:5], radians(300.0)])
    end = robot.tcp_frame([*robot.description.home[:5], radians(400.0)])
    with pytest.raises(Refused) as refused:
        robot.controller.move(lin_move(end._replace(z_mm=end.z_mm + 20.0), 1.0, 0.0))
    assert refused.value.code == JOINT_LIMIT
    limit = robot.description.position_max[5]
    reason = (
        rf"A6 would pass its limit of {limit:.7g} rad \(350 deg\) after [\d.]+% of the line: PTP gets there"
    )
    assert re.fullmatch(reason, refused.value.reason)


@pytest.mark.parametrize("name", ARMS)
@given(parts=st.tuples(*[st.floats(0.01, 0.99)] * 7))
def test_a_ptp_that_a_reason_recommends_is_accepted(name: str, parts: tuple[float, ...]) -> None:
    robot = SteppedRobot(name)
    controller, d = robot.controller, robot.description
    ranges = zip(d.position_min, d.position_max, parts, strict=False)
    target = controller.tool_frame(tuple(low + part * (high - low) for low, high, part in ranges))
    try:
        controller.check(lin_move(target, 0.5, 0.0))
    except Refused as refused:
        if "PTP" in refused.reason:
            controller.check(ptp_move(target, 0.5, 0.0))
