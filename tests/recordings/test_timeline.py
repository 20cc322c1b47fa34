"""What a recording was at any instant is found without reading all of it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from iiwa_sim.cell.surfaces import BoxSettings
from iiwa_sim.client import Iiwa
from iiwa_sim.recordings.read import Timeline
from iiwa_sim.simulator import Simulator
from tests.recordings.recorded import FAR, RATE_HZ, contents

SPEEDS = (0.3,) * 7
TICK_S = 1.0 / RATE_HZ
LATER = 123  # ticks, after which the recording begins


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording that begins in mid-run, of a move, of questions, and of a surface that comes."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    with Simulator(clock="stepped") as simulator, Iiwa(simulator.host, simulator.port) as driver:
        simulator.advance(LATER * TICK_S)
        with simulator.record(path):
            driver.joint_move(FAR, SPEEDS)
            for _ in range(10):
                simulator.advance(0.1)
                driver.get_status()
            box = BoxSettings(name="box", stiffness_n_per_m=1e4, x_mm=-900, size_mm=(10, 20, 30))
            simulator.backdoor.add_surface(box)
            simulator.advance(0.1)
    return path


def test_a_state_is_found_at_every_instant(run: Path) -> None:
    timeline, states = Timeline(run), contents(run, "/state")
    assert (timeline.start_s, timeline.end_s) == pytest.approx((LATER * TICK_S, states[-1]["time_s"]))
    for place in (*range(0, len(states), 17), len(states) - 1, 3, 200):  # back and forth, across chunks
        time_s = states[place]["time_s"]
        assert timeline.state_at(time_s) == states[place]
        assert timeline.state_at(time_s + 0.4 * TICK_S) == states[place], "the last one before"
    assert timeline.state_at(-1.0) == states[0]
    assert timeline.state_at(1e6) == states[-1]


def test_what_was_said_and_what_happened_is_told_up_to_an_instant(run: Path) -> None:
    timeline = Timeline(run)
    for topic in ("/dialogue", "/events"):
        told = partial(timeline.last, topic)
        wanted = contents(run, topic)
        assert len(wanted) >= 4
        assert told(timeline.end_s, 1000) == wanted
        assert told(timeline.end_s, 3) == wanted[-3:]
        assert told(timeline.end_s, 0) == []
        for time_s in (each["time_s"] for each in wanted):
            assert told(time_s, 1000) == [each for each in wanted if each["time_s"] <= time_s]
        assert told(wanted[0]["time_s"] - 1.0, 10) == []
