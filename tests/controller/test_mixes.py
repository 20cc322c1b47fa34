"""Random commands at random ticks: properties that hold at every tick."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.controller.state import snapshot
from tests.mixes import Mix
from tests.samples import MANY
from tests.stepped import VELOCITY_TOLERANCE, assert_within_limits

COMMANDS = 10 if MANY else 7
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@given(seeds, st.sampled_from([0.001, 0.002, 0.01]), st.booleans())
@example(428, 0.001, False)  # once a clock all but stood still: 3.4 times the jerk
def test_random_commands_keep_limits_and_ticks_at_rest_may_be_left_out(
    seed: int, tick_s: float, forces: bool
) -> None:
    mix, again = (Mix(seed, tick_s, forces=forces, skips=skips) for skips in (False, True))
    for each in (mix, again):
        each.run(COMMANDS)
    assert mix.robot.joints == again.robot.joints, "to the last bit"
    assert mix.exchanges == again.exchanges
    assert snapshot(mix.robot.controller) == snapshot(again.robot.controller)
    if not forces:
        assert_within_limits(mix.robot)
    speeds = np.abs(np.diff(mix.robot.joints, axis=0)) / mix.robot.tick_s
    assert (speeds <= np.array(mix.robot.description.velocity) * VELOCITY_TOLERANCE).all()
