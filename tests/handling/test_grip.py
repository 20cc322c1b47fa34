"""Where jaws close on a part."""

from __future__ import annotations

from math import pi

import pytest

from iiwa_sim.frames import Frame, Transform
from iiwa_sim.handling.grip import grip_width, on_pads, patch
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.handling.part import Part
from tests.handling.scenes import BALL, BLOCK, PIN

JAWS = Jaws(0.08, 0.2, 40.0, 0.02, 0.03)


def in_tcp(
    x_mm: float = 0.0, z_mm: float = -10.0, alpha: float = 0.0, beta: float = 0.0, gamma: float = 0.0
) -> Transform:
    return Frame(x_mm, 0.0, z_mm, alpha, beta, gamma).to_transform()


@pytest.mark.parametrize(
    ("part", "pose", "width_mm"),
    [
        (BLOCK, in_tcp(), 40.0),
        (BLOCK, in_tcp(gamma=pi / 2), 60.0),
        (BLOCK, in_tcp(alpha=pi / 4), 40.0 * 2**0.5),
        (PIN, in_tcp(), 30.0),
        (PIN, in_tcp(gamma=pi / 2), 60.0),
        (BALL, in_tcp(alpha=1.0, beta=2.0), 40.0),
    ],
)
def test_how_wide_it_is_between_the_jaws(part: Part, pose: Transform, width_mm: float) -> None:
    assert grip_width(part, pose) == pytest.approx(1e-3 * width_mm)


@pytest.mark.parametrize(
    ("part", "pose", "is_on"),
    [
        (BLOCK, in_tcp(), True),
        (BLOCK, in_tcp(x_mm=29.9), True),  # its face is 20 mm to each side, the pad 10
        (BLOCK, in_tcp(x_mm=30.1), False),
        (BLOCK, in_tcp(z_mm=29.9), True),  # 30 mm up and down: above the tips
        (BLOCK, in_tcp(z_mm=30.1), False),
        (BLOCK, in_tcp(z_mm=-60.1), False),  # the pads are 30 mm long
        (BLOCK, in_tcp(alpha=pi / 4), True),
        (BLOCK, in_tcp(x_mm=10.1, alpha=pi / 4), False),  # on two edges, 0 wide
        (BALL, in_tcp(), True),
        (BALL, in_tcp(x_mm=10.1), False),  # at one point of each side
        (BALL, in_tcp(z_mm=0.1), False),
        (PIN, in_tcp(x_mm=9.9, z_mm=29.0), True),
        (PIN, in_tcp(x_mm=10.1), False),
        (PIN, in_tcp(x_mm=10.1, gamma=pi / 2), True),  # by its ends, 15 mm wide
        (PIN, in_tcp(x_mm=39.0, beta=pi / 2), True),  # lying along x
    ],
)
def test_which_parts_the_pads_meet(part: Part, pose: Transform, is_on: bool) -> None:
    assert on_pads(part, pose, JAWS) is is_on


def test_a_tilted_pin_is_met_where_it_is_outermost() -> None:
    """Tilted by 30 degrees about x: the farthest points are those of its rims."""
    pose = in_tcp(gamma=pi / 6)
    (across, wide), (along, long) = patch(PIN, pose)
    assert (across, wide, long) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    y = 30.0 * 0.5 + 15.0 * 0.75**0.5
    assert grip_width(PIN, pose) == pytest.approx(2e-3 * y)
    assert abs(along) == pytest.approx(1e-3 * (30.0 * 0.75**0.5 - 15.0 * 0.5))
