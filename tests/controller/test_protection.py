"""The robot protects itself: torques on joints, collisions, the speed and the place of the TCP."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import STOP_TRIGGERED, ErrorRecord, Refused
from iiwa_sim.controller.limits_watch import Safety
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from tests.backdoor.bench import backdoor_of
from tests.requests import joint_move, lin_move
from tests.stepped import ARMS, SteppedRobot

TICK_S = 0.002
TORQUE_LIMITS = {name: load_robot(name).torque for name in ARMS}
NO_WRENCH = (0.0,) * 6


def watched(
    name: str = ARMS[0], *, floor_mm: float | None = None, stiffness: float = 50_000.0, **safety: object
) -> SteppedRobot:
    """At home, which is `floor_mm` above a hard floor if there is one."""
    robot = SteppedRobot(name)
    surfaces = []
    if floor_mm is not None:
        top_mm = robot.controller.tool_frame().z_mm - floor_mm
        pose = Frame(0.0, 0.0, top_mm, 0.0, 0.0, 0.0).to_transform()
        surfaces = [Surface("floor", Plane(), pose, stiffness, 0.0, 0.0)]
    robot.controller = Controller(
        robot.description,
        TICK_S,
        contact=TcpContact(surfaces, 0.0),
        safety=Safety(**safety),  # type: ignore[arg-type]
        on_event=robot._on_event,
    )
    robot.joints = [robot.controller.joints]
    return robot


def passes(robot: SteppedRobot, ticks: int = 5) -> None:
    """Let time pass like a clock: a robot at rest makes no ticks."""
    for _ in range(ticks):
        if robot.controller.resting:
            robot.controller.skip(1)
        else:
            robot.step()


def down(robot: SteppedRobot, by_mm: float) -> Frame:
    here = robot.controller.tool_frame()
    return here._replace(z_mm=here.z_mm - by_mm)


def largest_part(robot: SteppedRobot) -> float:
    """Return the largest joint torque over its limit."""
    torques = np.abs(robot.controller.joint_torque())
    return float(np.max(torques / np.array(robot.description.torque)))


def assert_stopped_itself(robot: SteppedRobot, *words: str) -> None:
    """Check for one error, reported once, which rejects moves until a reset."""
    assert len(robot.faults) == 1
    code, reason = robot.faults[0]
    assert code == STOP_TRIGGERED
    assert reason.startswith("protective stop: ")
    assert all(word in reason for word in words), reason
    assert robot.controller.errors.last == ErrorRecord(code, reason)
    assert (robot.controller.status().in_error, robot.controller.status().error_code) == (1, STOP_TRIGGERED)
    with pytest.raises(Refused, match="no move before reset error: protective stop"):
        robot.controller.move(joint_move(robot.controller.joints, [0.1] * len(robot.controller.joints)))


@pytest.mark.parametrize("name", ARMS)
def test_a_robot_that_presses_too_hard_stops_in_the_tick_in_which_a_joint_passes_its_torque_limit(
    name: str,
) -> None:
    robot = watched(name, floor_mm=5.0)
    waits = robot.controller.move(lin_move(down(robot, 60.0), 0.2, 0.0))
    while not robot.faults:
        assert largest_part(robot) <= 1.0
        robot.step()
    assert largest_part(robot) > 1.0
    assert_stopped_itself(robot, "torque on A", "its limit is")
    assert not robot.controller.motions.is_pending(waits)
    robot.runs_until_stopped()
    assert len(robot.faults) == 1


def test_after_a_reset_the_robot_may_move_out_but_not_farther_in() -> None:
    robot = watched(floor_mm=5.0)
    start = robot.controller.tool_frame()
    robot.controller.move(lin_move(down(robot, 60.0), 0.2, 0.0))
    robot.runs_until_stopped()
    robot.controller.errors.reset()
    robot.step(5)
    assert len(robot.faults) == 1, "it may stay where it is"
    robot.controller.move(lin_move(down(robot, 10.0), 0.1, 0.0))
    robot.runs_until_stopped()
    assert len(robot.faults) == 2
    robot.controller.errors.reset()
    states = backdoor_of(robot.controller)
    for _ in range(2):
        robot.step(5)
        states.restore_state("start")
        robot.controller.move(lin_move(start, 0.2, 0.0))
        robot.runs_until_stopped()
        assert len(robot.faults) == 2
        assert robot.controller.tool_frame() == pytest.approx(start, abs=1e-6)
    robot.controller.move(lin_move(down(robot, 60.0), 0.2, 0.0))
    robot.runs_until_stopped()
    assert len(robot.faults) == 3, "it is watched as before"


@given(
    name=st.sampled_from(ARMS),
    joint=st.integers(0, 5),
    part=st.sampled_from([0.999, -0.999, 1.001, -1.001]),
    wrench=st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6),
)
def test_pushes_on_joints_count_one_by_one_at_rest_too(
    name: str, joint: int, part: float, wrench: list[float]
) -> None:
    """The push is what a wrench leaves up to the limit of that joint."""
    robot = watched(name)
    limits = TORQUE_LIMITS[name]
    robot.controller.load.wrench = tuple(wrench)  # type: ignore[assignment]
    by_wrench = robot.controller.joint_torque()
    push = [0.0] * len(limits)
    push[joint] = part * limits[joint] - by_wrench[joint]
    robot.controller.load.joint_push = tuple(push)
    assert not robot.controller.resting
    robot.step()
    assert bool(robot.faults) == (abs(part) > 1.0)
    if robot.faults:
        assert_stopped_itself(robot, f"on A{joint + 1} is {1.001 * limits[joint]:.1f} Nm")


@pytest.mark.parametrize(
    ("safety", "push", "words"),
    [
        ({"force_n": 50.0}, (30.0, -30.0, 30.0, 0.0, 0.0, 0.0), ("collision", "force", "52.0 N", "50 N")),
        ({"torque_nm": 2.0}, (0.0, 0.0, 0.0, 0.0, 2.5, 0.0), ("collision", "torque", "2.5 Nm", "2 Nm")),
    ],
)
def test_a_collision_is_a_force_or_torque_at_the_tcp_above_its_threshold(
    safety: dict[str, float], push: tuple[float, ...], words: tuple[str, ...]
) -> None:
    robot, unwatched = watched(**safety), watched()
    robot.controller.load.wrench = tuple(0.7 * value for value in push)
    robot.step(3)
    assert not robot.faults
    for each in (robot, unwatched):
        each.controller.load.wrench = push
        each.step()
    assert_stopped_itself(robot, *words)
    assert not unwatched.faults


def test_collision_detection_is_set_read_and_switched_off() -> None:
    robot = watched(torque_nm=3.0)
    assert robot.controller.protection.collision_detection == (0.0, 3.0)
    robot.controller.protection.set_collision_detection(10.0, 0.0)
    assert robot.controller.protection.collision_detection == (10.0, 0.0)
    robot.controller.load.wrench = (0.0, 0.0, 11.0, 0.0, 0.0, 0.0)
    robot.controller.protection.set_collision_detection(0.0, 0.0)
    robot.step()
    assert not robot.faults
    robot.controller.protection.set_collision_detection(10.0, 0.0)
    assert not robot.controller.resting, "what is applied has to be judged anew"
    robot.step()
    assert_stopped_itself(robot, "11.0 N")
    robot.controller.errors.reset()
    passes(robot)
    assert len(robot.faults) == 1, "what it stands in may stay"
    robot.controller.protection.set_collision_detection(10.0, 0.0)
    passes(robot, 1)
    assert len(robot.faults) == 2, "set anew, it allows nothing"


def test_the_tcp_runs_no_faster_than_its_limit_by_more_than_a_tick() -> None:
    robot = watched(tcp_speed_m_per_s=0.25)
    start = robot.controller.tool_frame()
    robot.controller.move(lin_move(start._replace(y_mm=start.y_mm + 200.0), 1.0, 0.0))
    before = start
    while not robot.faults:
        before = robot.controller.tool_frame()
        robot.step()
    after = robot.controller.tool_frame()
    assert np.linalg.norm(np.subtract(after[:3], before[:3])) / TICK_S > 250.0
    assert_stopped_itself(robot, "mm/s, its limit is 250 mm/s")
    robot.runs_until_stopped()
    robot.controller.errors.reset()
    robot.controller.set_override(0.05)
    robot.controller.move(lin_move(start, 1.0, 0.0))
    robot.runs_until_stopped()
    assert len(robot.faults) == 1


def test_a_tcp_that_leaves_its_box_stops_and_may_come_back() -> None:
    x, y, z = (1e-3 * at for at in watched().controller.tool_frame()[:3])
    robot = watched(box=((x - 1.0, y - 1.0, z - 1.0), (x + 1.0, y + 0.05, z + 1.0)))
    start = robot.controller.tool_frame()
    outside = start._replace(y_mm=start.y_mm + 150.0)
    robot.controller.move(lin_move(outside, 0.2, 0.0))
    robot.runs_until_stopped()
    assert_stopped_itself(robot, "TCP is at y", "its box is")
    for target in (outside, start):
        robot.controller.errors.reset()
        robot.controller.move(lin_move(target, 0.2, 0.0))
        robot.runs_until_stopped()
        assert len(robot.faults) == 2


def test_an_excess_over_one_limit_is_none_over_another() -> None:
    robot = watched(tcp_speed_m_per_s=0.25)
    robot.controller.load.joint_push = (3.0 * robot.description.torque[0],) + (0.0,) * 6
    robot.step()
    robot.controller.errors.reset()
    robot.controller.move(lin_move(down(robot, 60.0), 1.0, 0.0))
    robot.runs_until_stopped()
    assert "its limit is 250 mm/s" in robot.faults[-1][1]


@pytest.mark.parametrize("reset_first", [False, True])
def test_a_push_as_great_as_the_one_before_is_detected_in_the_next_tick(reset_first: bool) -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.protection.set_collision_detection(50.0, 0.0)
    for times in range(1, 4):
        controller.load.wrench = (90.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        passes(robot, 1)
        assert len(robot.faults) == times
        passes(robot)
        for resets in (reset_first, not reset_first):
            if resets:
                controller.errors.reset()
            else:
                controller.load.wrench = NO_WRENCH
            passes(robot)
        assert controller.resting
