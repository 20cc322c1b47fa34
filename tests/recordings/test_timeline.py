"""What a recording was at any instant is found without reading all of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from iiwa_sim.cell.surfaces import BoxSettings
from iiwa_sim.client import Iiwa
from iiwa_sim.recordings.read import Recorded, Timeline
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


def test_states_of_a_span_are_as_many_as_are_wanted(run: Path) -> None:
    timeline, states = Timeline(run), contents(run, "/state")
    from_s, to_s = states[40]["time_s"], states[240]["time_s"]
    assert timeline.states(from_s, to_s, 1000) == states[40:241]
    assert timeline.states(from_s, to_s, 5) == states[40:241:41]
    assert timeline.states(-10.0, timeline.start_s, 10) == states[:1]
    assert timeline.states(1e6, 2e6, 10) == []


def test_what_was_said_and_what_happened_is_told_up_to_an_instant(run: Path) -> None:
    timeline = Timeline(run)
    for topic, told in (("/dialogue", timeline.said), ("/events", timeline.happened)):
        wanted = contents(run, topic)
        assert len(wanted) >= 4
        assert told(timeline.end_s, 1000) == wanted
        assert told(timeline.end_s, 3) == wanted[-3:]
        assert told(timeline.end_s, 0) == []
        for time_s in (each["time_s"] for each in wanted):
            assert told(time_s, 1000) == [each for each in wanted if each["time_s"] <= time_s]
        assert told(wanted[0]["time_s"] - 1.0, 10) == []


def test_the_cell_is_the_one_that_held_then(run: Path) -> None:
    timeline = Timeline(run)
    assert timeline.cell_at(timeline.start_s)["surfaces"] == timeline.cell_at(-1.0)["surfaces"] == []
    (box,) = timeline.cell_at(timeline.end_s)["surfaces"]
    assert (box["shape"], box["name"], box["size_mm"]) == ("box", "box", pytest.approx([10.0, 20.0, 30.0]))


@pytest.mark.parametrize("share", [0.6, 0.9])
def test_one_that_was_cut_off_is_read_as_far_as_it_goes(run: Path, tmp_path: Path, share: float) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(run.read_bytes()[: round(share * chunk_ends(run)[-1])])
    timeline, wanted = Timeline(path), list(Recorded(path).states())
    assert timeline.cut
    assert len(wanted) > 10
    found = timeline.states(timeline.start_s, timeline.end_s, 10_000)
    assert [each["tick"] for each in found] == [each.tick for each in wanted]
    assert [each["text"] for each in timeline.said(timeline.end_s, 1000)] == [
        each.text for each in Recorded(path).dialogue()
    ]


def test_a_damaged_one_is_read_up_to_the_damage(run: Path, tmp_path: Path) -> None:
    ends, data = chunk_ends(run), bytearray(run.read_bytes())
    data[ends[3] - 1] ^= 0x55  # the last byte of the content of the fourth chunk
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    timeline, states = Timeline(path), contents(run, "/state")
    assert timeline.cut
    assert timeline.start_s < timeline.end_s < states[-1]["time_s"]
    assert timeline.state_at(1e6)["tick"] == timeline.states(0.0, 1e6, 10_000)[-1]["tick"]


def test_a_long_one_is_thinned_out(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("iiwa_sim.recordings.read.MOST_STATES", 100)
    timeline, states = Timeline(run), contents(run, "/state")
    ticks = [each["tick"] for each in timeline.states(0.0, 1e6, 10_000)]
    assert len(ticks) <= 100
    step = ticks[1] - ticks[0]
    assert ticks == [state["tick"] for state in states][::step]


def chunk_ends(path: Path) -> list[int]:
    with path.open("rb") as stream:
        records = StreamReader(stream, emit_chunks=True).records
        return [stream.tell() for record in records if isinstance(record, Chunk)]
