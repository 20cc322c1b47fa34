"""LIN as a polynomial: on the line everywhere, the same as today's planner, refused where that refuses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.frames import Transform, rotation_about
from iiwa_sim.motion import lin as sampled_lin
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.path.bridge import at_border
from iiwa_sim.motion.path.lin import lin
from iiwa_sim.motion.path.line_joints import LineOutOfReach, SingularLine
from iiwa_sim.motion.path.polynomial import Polynomial
from iiwa_sim.motion.sampled_path import Joints
from iiwa_sim.motion.tcp_line import TcpLine
from tests.robot.arms import BUILT_IN, Arm, arm_named

S = np.linspace(0.0, 1.0, 301)


class Line(NamedTuple):
    """A line of the flange of one arm."""

    arm: Arm
    start: Joints
    line: TcpLine
    redundancy: float
    status: int

    def __repr__(self) -> str:
        return f"{self.arm.description.name} from {self.start}"

    def polynomial(self) -> Polynomial:
        return lin(self.arm.inverse, self.start, self.line, self.redundancy, self.status)

    def sampled(self) -> sampled_lin.Line:
        """As today's planner has it."""
        d = self.arm.description
        limits = JointLimits(np.array(d.velocity), np.array(d.acceleration), np.array(d.jerk))
        return sampled_lin.Line(self.arm.inverse, limits, self.start, self.line, self.redundancy, self.status)

    def answer(self, *, sampled: bool) -> str:
        try:
            self.sampled() if sampled else self.polynomial()
        except (LineOutOfReach, sampled_lin.LineOutOfReach):
            return "out of reach"
        except (SingularLine, sampled_lin.SingularLine):
            return "singular"
        return "done"


def between(arm: Arm, start: Joints, end: Joints, tool: Transform) -> Line:
    """The line from where the flange is at joint positions to where it is at others."""
    line = TcpLine(arm.model.flange(start), arm.model.flange(end), tool)
    inverse = arm.inverse
    return Line(arm, start, line, inverse.redundancy(end), inverse.status(start))


@st.composite
def lines(draw: st.DrawFn) -> Line:
    """Between random joint positions not too far from each other, with random tools."""
    arm = arm_named(draw(st.sampled_from(BUILT_IN)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    d = arm.description
    start = 0.9 * rng.uniform(d.position_min, d.position_max)
    end = np.clip(start + rng.normal(size=len(start)) * 0.4, d.position_min, d.position_max)
    tool = Transform(rotation_about((0.0, 0.6, 0.8), 0.7), (0.05, -0.02, rng.uniform(0.0, 0.3)))
    return between(arm, tuple(start.tolist()), tuple(end.tolist()), tool)


def off_the_line(line: Line, path: Polynomial, s: Array = S) -> float:
    """How far the flange is from where the line has it (m and elements of rotations), at most."""
    worst = 0.0
    for place in s.tolist():
        reached, wanted = line.arm.model.flange(path.joints(place)), line.line.flange(place)
        worst = max(
            worst,
            float(np.abs(np.subtract(reached.translation, wanted.translation)).max()),
            float(np.abs(np.subtract(reached.rotation, wanted.rotation)).max()),
        )
    return worst


def assert_continuous(path: Polynomial) -> None:
    """At borders positions agree but for rounding, derivatives as far as what fits leave allows."""
    borders, rows = path.borders.tolist(), path.coefficients
    first = path.offsets.tolist()
    for k, border in enumerate(borders[1:-1], start=1):
        before = at_border(borders[k - 1], border, rows[first[k - 1] : first[k]], border)
        after = at_border(border, borders[k + 1], rows[first[k] : first[k + 1]], border)
        for order, (one, other) in enumerate(zip(before, after, strict=True)):
            allowed = (1e-14, 1e-7, 1e-4, 1e-2)[order]
            assert np.abs(one - other).max() <= allowed * max(1.0, float(np.abs(one).max()))


@settings(max_examples=150, deadline=None)
@given(line=lines())
def test_a_line_is_straight_and_as_todays_planner_has_it(line: Line) -> None:
    today = line.answer(sampled=True)
    answer = line.answer(sampled=False)
    if answer != "done":
        assert answer == today
        return
    path = line.polynomial()
    assert off_the_line(line, path) < 1e-9
    assert_continuous(path)
    assert path.joints(0.0) == line.start
    np.testing.assert_allclose(path.derivatives(np.array([0.0]))[0][0], line.start, atol=1e-14, rtol=0)
    np.testing.assert_allclose(path.derivatives(np.array([1.0]))[0][0], path.end, atol=1e-14, rtol=0)
    assert path.tcp_length_m == line.line.length_m
    assert today in {"done", "singular"}  # what today's samples do not resolve may be done
    if today == "done":
        np.testing.assert_allclose(path.derivatives(S)[0], line.sampled().joints_along(S), atol=1e-8, rtol=0)
