"""What stiffness a move or a hold may ask for."""

from __future__ import annotations

from math import inf, nan

import pytest

from iiwa_sim.controller.errors import EXECUTION, Refused
from tests.asked import gravity_hold, lin_stiff_move
from tests.stepped import SteppedRobot


@pytest.mark.parametrize("stiffness", [-1.0, 5000.5, inf, nan])
def test_a_stiffness_out_of_range_is_refused_with_its_unit(stiffness: float) -> None:
    controller = SteppedRobot().controller
    here = controller.tool_frame()
    for request, unit in (
        (lin_stiff_move(here, 0.1, stiffness, [0.0] * 6), "N/m"),
        (gravity_hold(stiffness), "Nm/rad"),
    ):
        with pytest.raises(Refused) as refused:
            controller.move(request)
        told = f"stiffness {stiffness:g} {unit}: expected 0 to 5000"
        assert (refused.value.code, refused.value.reason) == (EXECUTION, told)


def test_the_largest_stiffness_is_taken() -> None:
    robot = SteppedRobot()
    robot.controller.move(lin_stiff_move(robot.controller.tool_frame(), 0.1, 5000.0, [0.0] * 6))
    robot.controller.move(gravity_hold(5000.0))
