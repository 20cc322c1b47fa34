"""Whatever is said, and whenever: what holds at every tick."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.controller.state import snapshot
from tests.mixes import Mix
from tests.stepped import ROUNDING, assert_within_limits

COMMANDS = 10
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@given(seeds, st.sampled_from([0.001, 0.002, 0.01]))
@example(428, 0.001)  # once a clock all but stood still: 3.4 times the jerk
def test_planned_motion_keeps_its_limits_and_each_line_has_its_reply(seed: int, tick_s: float) -> None:
    mix = Mix(seed, tick_s, forces=False)
    mix.run(COMMANDS)
    assert_within_limits(mix.robot)


@given(seeds)
def test_the_same_again_is_the_same_bit_for_bit_also_if_ticks_at_rest_are_left_out(seed: int) -> None:
    mix, again = (Mix(seed, 0.002, forces=True, skips=skips) for skips in (False, True))
    for each in (mix, again):
        each.run(COMMANDS)
    assert mix.robot.joints == again.robot.joints
    assert mix.said == again.said
    assert snapshot(mix.robot.controller) == snapshot(again.robot.controller)
    assert np.isfinite(mix.robot.joints).all()
    speeds = np.abs(np.diff(mix.robot.joints, axis=0)) / mix.robot.tick_s
    assert (speeds <= np.array(mix.robot.description.velocity) * (1.0 + ROUNDING)).all()
