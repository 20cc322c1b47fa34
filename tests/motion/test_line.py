"""LIN as a polynomial: on the line everywhere, or refused, with where it cannot go on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import IDENTITY, Frame, Transform, rotation_about
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.lin import LineOutOfReach, SingularLine, TcpLine, at_border, lin
from iiwa_sim.motion.plan_kernel import Polynomial
from tests.robot.arms import BUILT_IN, Arm, arm_named

S = np.linspace(0.0, 1.0, 301)
NO_TOOL = IDENTITY


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

    def answer(self) -> Polynomial | str:
        try:
            return self.polynomial()
        except LineOutOfReach:
            return "out of reach"
        except SingularLine:
            return "singular"


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


REGULAR = (1e-14, 1e-6, 1e-3, 0.1)
SINGULAR = (1e-14, 1e-3)
"""What may differ at a border, of positions and each derivative; near singular poses rounding shows."""


def assert_continuous(path: Polynomial, tolerances: tuple[float, ...]) -> None:
    """At borders positions agree but for rounding, derivatives as far as what fits leave allows."""
    borders, rows = path.borders.tolist(), path.coefficients
    first = path.offsets.tolist()
    for k, border in enumerate(borders[1:-1], start=1):
        before = at_border(borders[k - 1], border, rows[first[k - 1] : first[k]], border)
        after = at_border(border, borders[k + 1], rows[first[k] : first[k + 1]], border)
        for allowed, one, other in zip(tolerances, before, after, strict=False):
            assert np.abs(one - other).max() <= allowed * max(1.0, float(np.abs(one).max()))


@given(line=lines())
def test_a_line_is_straight(line: Line) -> None:
    path = line.answer()
    if isinstance(path, str):
        return
    assert off_the_line(line, path) < 1e-9
    assert_continuous(path, REGULAR)
    assert path.joints(0.0) == line.start
    np.testing.assert_allclose(path.derivatives(np.array([0.0]))[0][0], line.start, atol=1e-14, rtol=0)
    np.testing.assert_allclose(path.derivatives(np.array([1.0]))[0][0], path.end, atol=1e-14, rtol=0)
    assert path.tcp_length_m == line.line.length_m


WRIST = {"srs": 5, "opw": 4}
"""The joint that is 0 where the wrist is stretched."""


@given(
    name=st.sampled_from(BUILT_IN),
    seed=st.integers(0, 2**32 - 1),
    off=st.sampled_from([0.0, 1e-12, 1e-9, -1e-6, 1e-5, 1e-4, -1e-3, 1e-2, -5e-2]),
    towards=st.booleans(),
)
def test_a_line_to_or_from_a_nearly_stretched_wrist_is_straight(
    name: str, seed: int, off: float, towards: bool
) -> None:
    arm = arm_named(name)
    d, rng = arm.description, np.random.default_rng(seed)
    q = np.array(d.home) + rng.uniform(-0.6, 0.6, len(d.home))
    q[WRIST[d.kinematics]] = off
    q = np.clip(q, d.position_min, d.position_max)
    beside = np.clip(q + rng.uniform(-0.3, 0.3, len(q)), d.position_min, d.position_max)
    if d.kinematics == "srs":
        beside[2] = q[2]
    ends = tuple(beside.tolist()), tuple(q.tolist())
    assert_straight_where_done(between(arm, *(ends if towards else ends[::-1]), NO_TOOL))


@given(
    name=st.sampled_from(BUILT_IN),
    seed=st.integers(0, 2**32 - 1),
    digits=st.sampled_from([None, 9, 6]),
    kind=st.sampled_from(["through", "to", "from", "turning about"]),
)
def test_a_line_in_the_plane_of_the_arm_passes_the_stretched_wrist(
    name: str, seed: int, digits: int | None, kind: str
) -> None:
    """Through it, to it, from it, turning in it; targets as exact as floats, or as read from the wire."""
    arm = arm_named(name)
    rng = np.random.default_rng(seed)
    wrist, six = WRIST[arm.description.kinematics], len(arm.description.home) == 6
    q = np.array([0.3, -1.4, 1.4, 0.0, 0.2, 0.0] if six else [0.3, 0.5, 0.0, -1.3, 0.0, 0.2, 0.2])
    end = q.copy()
    end[[1, 2 if six else 3]] += rng.uniform(-0.2, 0.2, 2)
    end[wrist] = {"through": -0.2, "to": 0.0, "from": 0.0, "turning about": 0.0}[kind]
    if kind == "turning about":
        q = end.copy()
        end[-1] += 0.5
    if kind == "from":
        q, end = end, q
    start = tuple(q.tolist())
    target = arm.model.flange(end.tolist())
    if digits is not None:
        wire = Frame.from_transform(target)
        target = Frame(*(round(value, digits) for value in wire)).to_transform()
    inverse = arm.inverse
    line = Line(
        arm, start, TcpLine(arm.model.flange(start), target, NO_TOOL), inverse.redundancy(start),
        inverse.status(start),
    )  # fmt: skip
    path = assert_straight_where_done(line)
    if digits is None and kind in {"through", "to"}:
        assert path is not None
        other = WRIST[arm.description.kinematics] - 1
        assert np.abs(path.derivatives(S)[0][:, other]).max() < 1e-9


def assert_straight_where_done(line: Line) -> Polynomial | None:
    path = line.answer()
    if isinstance(path, str):
        return None
    assert off_the_line(line, path) < 1e-6
    assert_continuous(path, SINGULAR)
    return path


def test_a_line_out_of_reach_says_from_where_on() -> None:
    arm = arm_named(BUILT_IN[0])
    home = arm.description.home
    start = arm.model.flange(home)
    x, y, z = start.translation
    target = Transform(start.rotation, (x + 1.0, y, z))
    line = TcpLine(start, target, NO_TOOL)
    with pytest.raises(LineOutOfReach) as out:
        Line(arm, home, line, 0.0, arm.inverse.status(home)).polynomial()
    s = out.value.s
    for place, reached in ((s - 1e-9, True), (s + 1e-9, False)):
        joints = arm.inverse.joints(line.flange(place), 0.0, arm.inverse.status(home), home)
        assert (joints is not None) == reached


@pytest.mark.parametrize("length_mm", [0.0, 1e-9, 1e-6, 1e-4, 0.1])
def test_lines_of_no_or_hardly_any_length(length_mm: float) -> None:
    for name in BUILT_IN:
        arm = arm_named(name)
        home = arm.description.home
        start = arm.model.flange(home)
        x, y, z = start.translation
        goal = Transform(start.rotation, (x + length_mm / 1000.0, y, z))
        line = TcpLine(start, goal, NO_TOOL)
        path = Line(arm, home, line, arm.inverse.redundancy(home), arm.inverse.status(home)).polynomial()
        assert path.joints(0.0) == home
        assert np.abs(np.subtract(path.end, home)).max() <= 10.0 * length_mm / 1000.0 + 1e-12
        assert len(path.borders) == 2
