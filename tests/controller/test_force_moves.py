"""Force moves: the stop begins in the tick after a force has passed its threshold, and in no other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from iiwa_sim.cell.cell import Cell
from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import Thresholds
from iiwa_sim.frames import IDENTITY, Frame, Transform
from tests import requests
from tests.requests import lin_force_move
from tests.stepped import ARMS, SteppedRobot, assert_within_limits, strong

STOP_S = 0.1
START = [0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0]
STARTS = {ARMS[0]: START, ARMS[1]: [0.0, -1.5, 1.6, 0.0, 1.4, 0.0]}


def at_start(name: str = ARMS[0]) -> SteppedRobot:
    robot = SteppedRobot(name)
    robot.goes_to(STARTS[name])
    return robot


START_MM = {ARMS[0]: (600.0, 0.0, 410.410161514), ARMS[1]: (445.0, 0.0, 660.0)}
"""The TCP of a tool of 150 mm at home, where it points down: its x and z are against those of the base."""
BELOW_MM, STIFFNESS = 20.0, 2e4


def above_table(name: str, damping: float = 0.0) -> SteppedRobot:
    """Return a robot with a probe that points down, `BELOW_MM` above a table."""
    description, tool = strong(name), Frame(0.0, 0.0, 150.0, 0.0, 0.0, 0.0).to_transform()
    top = Transform(IDENTITY.rotation, (0.0, 0.0, 1e-3 * (START_MM[name][2] - BELOW_MM)))
    table = Surface("table", Plane(), top, STIFFNESS, damping, 0.0)
    return SteppedRobot(cell=Cell(description, description.home, tool, 0.003, (table,)))


def beside(robot: SteppedRobot, y_mm: float = 0.0, z_mm: float = 0.0) -> Frame:
    """Return a frame with the orientation of the TCP, shifted in the axes of the base."""
    here = robot.controller.tool_frame()
    return here._replace(y_mm=here.y_mm + y_mm, z_mm=here.z_mm + z_mm)


def along_z(threshold: float) -> Thresholds:
    return (None, None, threshold)


@pytest.mark.requirement("FRC005", "FRC008", "FRC009")
@given(
    kind=st.sampled_from(["lin", "ptp"]),
    name=st.sampled_from(ARMS),
    speed=st.floats(0.02, 1.0),
    threshold=st.floats(0.5, 60.0),
    pushed_n=st.sampled_from([0.0, 15.0, -70.0]),
    damping=st.sampled_from([0.0, 0.5]),
    override=st.sampled_from([1.0, 0.3]),
)
def test_the_stop_begins_in_the_tick_after_the_threshold_is_passed(
    kind: str, name: str, speed: float, threshold: float, pushed_n: float, damping: float, override: float
) -> None:
    """The robot is then on the path of one that is cancelled in that tick."""
    robot, cancelled = above_table(name, damping), above_table(name, damping)
    target = beside(robot, z_mm=-100.0)
    for each in (robot, cancelled):
        each.controller.load.wrench = (0.0, pushed_n, pushed_n, 0.0, 0.0, 0.0)
        each.controller.set_override(override)
    number = force_move(robot, kind)(target, speed, 0.0, (None, 1.0, threshold))
    cancelled.controller.move(getattr(requests, f"{kind}_move")(target, speed, 0.0))
    while abs(cancelled.controller.cartesian_force()[2] - pushed_n) <= threshold:
        assert not robot.contacts
        for each in (robot, cancelled):
            each.step()
    (contact,) = robot.contacts
    assert contact[:2] == (number, "z")
    assert (contact.offset_n, contact.threshold_n) == (pushed_n, threshold)
    assert contact.force_n == robot.controller.cartesian_force()[2]
    assert contact.tcp == robot.controller.tool_frame()
    cancelled.cancel()
    assert cancelled.runs_until_stopped() * robot.tick_s <= STOP_S + 1e-9
    robot.runs_until_stopped()
    assert robot.joints == cancelled.joints
    depth_m = 1e-3 * (START_MM[name][2] - BELOW_MM + 3.0 - robot.controller.tool_frame().z_mm)
    felt_n = robot.controller.cartesian_force()[2]
    assert felt_n == pytest.approx(pushed_n - STIFFNESS * depth_m, rel=1e-3, abs=1e-2)
    assert not robot.controller.motions.is_pending(number)
    assert robot.controller.errors.last is None
    assert_within_limits(robot)


def force_move(robot: SteppedRobot, kind: str) -> Callable[..., int]:
    return lambda *values: robot.controller.move(getattr(requests, f"{kind}_force_move")(*values))


thresholds = st.tuples(*[st.one_of(st.none(), st.floats(1e-6, 1e3))] * 3)
targets = st.tuples(*[st.floats(-80.0, 80.0)] * 3)


@pytest.mark.requirement("FRC012", "FRC014", "FRC015")
@given(
    name=st.sampled_from(ARMS),
    moves=st.lists(
        st.tuples(
            st.sampled_from(["lin", "ptp"]), targets, st.floats(0.1, 1.0), st.floats(0.0, 50.0), thresholds
        ),
        min_size=1,
        max_size=4,
    ),
    pressing=st.floats(-100.0, 100.0),
)
def test_in_free_space_force_moves_are_moves_like_others(
    name: str, moves: list[tuple[Any, ...]], pressing: float
) -> None:
    guarded, plain = at_start(name), at_start(name)
    guarded.controller.load.wrench = (pressing, 0.0, -pressing, 0.0, 0.0, 0.0)  # the same all the time
    start = guarded.controller.tool_frame()
    end = start
    for kind, shift_mm, speed, blending_mm, each in moves:
        end = Frame(*np.add(start, [*shift_mm, 0.0, 0.0, 0.0]).tolist())
        try:
            force_move(guarded, kind)(end, speed, blending_mm, each)
        except Refused:  # a line that passes too close to a singular pose
            reject()
        plain.controller.move(getattr(requests, f"{kind}_move")(end, speed, blending_mm))
    for robot in (guarded, plain):
        robot.runs_until_stopped()
    assert guarded.joints == plain.joints
    assert guarded.contacts == []
    np.testing.assert_allclose(guarded.controller.tool_frame()[:3], end[:3], atol=1e-6)


def test_each_force_move_counts_from_the_force_at_its_own_command() -> None:
    robot = above_table(ARMS[0])
    c = robot.controller
    down, up = beside(robot, z_mm=-60.0), beside(robot)
    first = c.move(lin_force_move(down, 0.2, 0.0, along_z(10.0)))
    queued = c.move(lin_force_move(down, 0.2, 0.0, along_z(10.0)))  # at this command there is no force
    robot.runs_until_stopped()
    assert [contact.move for contact in robot.contacts] == [first, queued]
    held_n = c.cartesian_force()[2]
    assert held_n < -10.0
    here = c.tool_frame()
    deeper = c.move(lin_force_move(down, 0.02, 0.0, along_z(5.0)))
    robot.runs_until_stopped()
    contact = robot.contacts[-1]
    assert (contact.move, contact.offset_n) == (deeper, held_n)
    assert held_n - 2.0 * 5.0 < contact.force_n < held_n - 5.0
    assert here.z_mm - 3.0 < c.tool_frame().z_mm < here.z_mm - 0.25
    held_n = c.cartesian_force()[2]
    leaving = c.move(lin_force_move(up, 0.05, 0.0, along_z(5.0)))  # less force is a change, too
    robot.runs_until_stopped()
    contact = robot.contacts[-1]
    assert (contact.move, contact.offset_n) == (leaving, held_n)
    assert contact.force_n > held_n + 5.0
    assert c.tool_frame().z_mm < up.z_mm - 1.0
    assert_within_limits(robot)
