"""Weight and inertia of a body at the TCP."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from iiwa_sim.contact.payload import GRAVITY_M_S2, TcpMotion, body, seen_from
from iiwa_sim.frames import IDENTITY, Frame, Transform, apply, rotation_about
from iiwa_sim.wrench import NO_WRENCH

TICK_S = 0.002
INERTIA = (0.02, 0.03, 0.04, 0.001, -0.002, 0.003)


def circling(time_s: float, speed: float) -> Transform:
    """On a circle of 0.5 m round z of the base, turned along with it."""
    turn = speed * time_s
    return Transform(rotation_about((0.0, 0.0, 1.0), turn), (0.5 * cos(turn), 0.5 * sin(turn), 0.3))


def test_a_body_that_circles_pulls_outwards() -> None:
    """2 kg, 0.1 m farther out than the TCP, at 3 rad/s: m w^2 r, and its weight."""
    motion, speed = TcpMotion(circling(0.0, 3.0)), 3.0
    for tick in range(1, 6):
        motion.step(circling(tick * TICK_S, speed), TICK_S)
    wrench = motion.wrench(body(2.0, (0.1, 0.0, 0.0), INERTIA))
    weight = 2.0 * GRAVITY_M_S2
    # The torque: its weight on the arm of 0.1 m, and what turns a body that is not round about z.
    expected = (2.0 * speed**2 * 0.6, 0.0, -weight, 0.003 * speed**2, 0.1 * weight + 0.002 * speed**2, 0.0)
    assert wrench == pytest.approx(expected, rel=1e-4, abs=1e-4)


def test_a_body_that_is_turned_faster_and_faster_resists() -> None:
    """10 rad/s^2 about z, through its own centre: the inertia times that, against it."""

    def turned(time_s: float) -> Transform:
        return Transform(rotation_about((0.0, 0.0, 1.0), 5.0 * time_s**2), (0.0, 0.0, 0.0))

    motion = TcpMotion(turned(-TICK_S))
    for tick in range(3):
        motion.step(turned((tick - 1) * TICK_S), TICK_S)
    wrench = motion.wrench(body(2.0, (0.0, 0.0, 0.0), INERTIA))
    assert wrench == pytest.approx(
        (0.0, 0.0, -2.0 * GRAVITY_M_S2, -10.0 * -0.002, -10.0 * 0.003, -10.0 * 0.04), abs=1e-3
    )


def test_how_it_has_come_to_its_first_pose_is_not_known() -> None:
    """So no speed that it had is taken for an acceleration."""
    moments, speed = body(1.0, (0.0, 0.0, 0.0)), 1.0
    motion = TcpMotion(IDENTITY)
    for tick in range(1, 4):
        assert motion.wrench(moments) == (0.0, 0.0, -GRAVITY_M_S2, 0.0, 0.0, 0.0)
        assert not motion.still
        motion.step(Transform(IDENTITY.rotation, (speed * tick * TICK_S, 0.0, 0.0)), TICK_S)
    assert motion.wrench(moments)[0] == pytest.approx(0.0, abs=1e-9)


def test_it_is_still_when_three_poses_are_one() -> None:
    motion = TcpMotion(IDENTITY)
    for still in (False, True, True):
        motion.step(IDENTITY, TICK_S)
        assert motion.still is still
    assert motion.wrench(body(0.0, (0.0, 0.0, 0.0))) is NO_WRENCH
    motion.step(Transform(IDENTITY.rotation, (0.0, 0.0, 1e-6)), TICK_S)
    assert not motion.still
    motion.rest(IDENTITY)
    assert motion.still


def test_a_body_seen_from_elsewhere_is_its_points_seen_from_there() -> None:
    pose = Frame(100.0, -200.0, 300.0, 0.4, -0.5, 2.0).to_transform()
    points = [(0.1, 0.2, 0.3), (-0.3, 0.0, 0.2), (0.1, 0.1, 0.0)]
    centre = np.mean(points, axis=0)
    off = points - centre
    inertia = 0.5 * sum(np.dot(each, each) * np.eye(3) - np.outer(each, each) for each in off)
    six = (*np.diag(inertia).tolist(), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    x, y, z = centre.tolist()
    seen = np.array([(*apply(pose, point), 1.0) for point in points])
    assert seen_from(body(1.5, (x, y, z), six), pose) == pytest.approx(0.5 * seen.T @ seen, abs=1e-12)
