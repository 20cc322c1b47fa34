"""No tick of any program passes a limit."""

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from iiwa_sim.robot.description import load_robot
from tests.chains import chains, run
from tests.samples import some
from tests.stepped import ALL_ROBOTS, ARMS, SteppedRobot, assert_within_limits

# Shrinking a program takes minutes and makes it no clearer than the first that failed.
SETTINGS = settings(
    max_examples=some(60),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)


@pytest.mark.requirement("FRC002", "FRC006", "FRC014")
@pytest.mark.parametrize("name", ALL_ROBOTS)
@SETTINGS
@given(data=st.data())
def test_no_tick_of_any_program_passes_a_limit(name: str, data: st.DataObject) -> None:
    description = load_robot(name)
    robot = SteppedRobot(description)
    run(robot, data.draw(chains(len(description.joints), stops=True, longest=8)))
    assert_within_limits(robot)


@settings(SETTINGS, max_examples=some(30))
@given(data=st.data(), name=st.sampled_from(ARMS), rate_hz=st.sampled_from([100, 250, 1000]))
def test_nor_at_other_tick_rates(data: st.DataObject, name: str, rate_hz: int) -> None:
    description = load_robot(name)
    robot = SteppedRobot(description, 1.0 / rate_hz)
    run(robot, data.draw(chains(len(description.joints), stops=True, longest=8)))
    assert_within_limits(robot)


@settings(SETTINGS, max_examples=some(20))
@given(data=st.data(), name=st.sampled_from(ARMS))
def test_the_same_commands_at_the_same_ticks_give_the_same_motion(data: st.DataObject, name: str) -> None:
    program = data.draw(chains(len(load_robot(name).joints), stops=True, longest=8))
    first, second = SteppedRobot(name), SteppedRobot(name)
    run(first, program)
    run(second, program)
    assert first.joints == second.joints
