"""Chains of moves of every kind, with any blending, speeds and stops, appended at any time."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from iiwa_sim.robot.description import load_robot
from tests.chain_checks import (
    assert_keeps_all_promises,
    assert_keeps_its_paths,
    assert_keeps_its_speeds,
    is_to_be_passed_at_speed,
    least_speed_at,
)
from tests.chains import KINDS, Recorder, chains, random_chain
from tests.stepped import ALL_ROBOTS, ARMS, assert_within_limits, strong

# Shrinking a chain takes minutes; what the checks say names the tick and the moves.
SETTINGS = settings(
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example],
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)
FRAME_KINDS = tuple(
    kind for kind in KINDS if kind != "joint"
)  # these stop at their targets if they are told to


LONG_CHAIN_SPEED, LONG_CHAIN_TICK_S = 0.5, 0.01
PART = 8  # moves of a long chain that are looked at at once

names = st.sampled_from(ARMS)


def recorded(chain: list[Any], name: str, tick_s: float = 0.002) -> Recorder:
    recorder = Recorder(load_robot(name), tick_s)
    recorder.run(chain)
    return recorder


def chains_of(name: str, **kind: Any) -> st.SearchStrategy[list[Any]]:
    return chains(len(load_robot(name).joints), **kind)


@pytest.mark.requirement("FRC012", "FRC014", "FRC015")
@pytest.mark.parametrize("name", ALL_ROBOTS)
@SETTINGS
@given(data=st.data())
def test_chains_sent_at_once_keep_paths_regions_speeds_and_limits(name: str, data: st.DataObject) -> None:
    assert_keeps_all_promises(recorded(data.draw(chains_of(name, at_once=True)), name))


@pytest.mark.requirement("FRC002", "FRC003", "FRC006", "FRC012", "FRC013", "FRC014", "FRC015", "FRC016")
@pytest.mark.parametrize("name", ALL_ROBOTS)
@SETTINGS
@given(data=st.data())
def test_chains_sent_bit_by_bit_with_stops_between_do_so_too(name: str, data: st.DataObject) -> None:
    assert_keeps_all_promises(recorded(data.draw(chains_of(name, stops=True)), name))


@pytest.mark.requirement("FRC012", "FRC015")
@SETTINGS
@given(data=st.data(), name=names, at_once=st.booleans())
def test_a_chain_with_blending_is_never_slower_than_without(
    data: st.DataObject, name: str, at_once: bool
) -> None:
    recorder = recorded(data.draw(chains_of(name, kinds=FRAME_KINDS, at_once=at_once)), name)
    assert recorder.ticks() <= 1.005 * recorder.ticks(blending=False) + 1


@pytest.mark.slow
@pytest.mark.requirement("FRC012", "FRC015")
@pytest.mark.parametrize("name", ARMS)
def test_nearly_all_corners_that_can_be_blended_are_passed_at_speed(name: str) -> None:
    """Where no turn keeps the limits, or to stop is over sooner, the robot stops: that is rare."""
    least: list[float] = []
    chains = 40
    for seed in range(chains):
        for run in recorded(random_chain(seed, len(load_robot(name).joints)), name).runs:
            corners = range(len(run.moves) - 1)
            least.extend(least_speed_at(run, i) for i in corners if is_to_be_passed_at_speed(run, i))
    assert len(least) > 1.5 * chains
    assert np.mean(np.array(least) > 1.0) > 0.9


@pytest.mark.requirement("FRC003", "FRC012", "FRC013", "FRC014", "FRC015", "FRC016", "FRC025")
@SETTINGS
@given(data=st.data(), name=names, rate_hz=st.sampled_from([100, 250, 500, 1000]))
def test_chains_keep_their_promises_whatever_is_done_in_their_midst(
    data: st.DataObject, name: str, rate_hz: int
) -> None:
    """Moves of all kinds, at any time between them stops, overrides, cancelled moves and cleared queues."""
    chain = data.draw(chains_of(name, stops=True, overrides=True, cancels=True))
    assert_keeps_all_promises(recorded(chain, name, 1.0 / rate_hz))


@pytest.mark.requirement("FRC014", "FRC015")
@pytest.mark.parametrize("count", [30, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ARMS)
def test_as_many_as_a_thousand_moves_of_all_kinds_are_queued_and_blended(name: str, count: int) -> None:
    description = strong(name)  # so many random moves fold the arm, too
    recorder = Recorder(description, LONG_CHAIN_TICK_S)
    moves = itertools.chain.from_iterable(
        random_chain(seed, len(description.joints)) for seed in itertools.count()
    )
    while len(recorder.runs[-1].moves) < count:
        move = next(moves)
        if move.place != "far":  # these would take most of the time
            recorder.send_move(move, LONG_CHAIN_SPEED)
    recorder.finish()
    assert_within_limits(recorder.robot)
    (run,) = recorder.runs
    assert recorder.robot.joints[-1] == run.moves[-1].corner
    for part in run.parts(PART):
        assert_keeps_its_paths(part)
        assert_keeps_its_speeds(part)
