"""Recordings that were cut off anywhere are read up to the last whole chunk; rubbish is told in one line."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from hypothesis import example, given, settings
from hypothesis import strategies as st
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, breakup_chunk

from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.recordings import RecordingFault
from iiwa_sim.recordings.schemas import CHANNELS
from tests.recordings.recorded import FAR, Robot
from tests.samples import some


@cache
def whole() -> bytes:
    """A recording of a second of motion: some chunks."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        robot = Robot(path)
        robot.goes_to(*FAR)
        robot.step(600)
        robot.end()
        return path.read_bytes()


@cache
def chunk_ends() -> list[tuple[int, int]]:
    """Where each chunk ends in the file, and how many messages there are up to there."""
    ends, count = [], 0
    with tempfile.NamedTemporaryFile() as file:
        file.write(whole())
        file.flush()
        with Path(file.name).open("rb") as stream:
            for record in StreamReader(stream, emit_chunks=True).records:
                if isinstance(record, Chunk):
                    count += sum(type(each).__name__ == "Message" for each in breakup_chunk(record))
                    ends.append((stream.tell(), count))
    return ends


def messages_in(data: bytes) -> tuple[int, bool]:
    """How many, and whether the file was cut. Raises RecordingFault."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        path.write_bytes(data)
        recorded = Recorded(path)
        count = sum(1 for _ in recorded.messages(CHANNELS))
        return count, recorded.cut_at_s is not None


def outcome(data: bytes) -> tuple[int, bool] | str:
    """`messages_in` some bytes, or what is told of their fault."""
    try:
        return messages_in(data)
    except RecordingFault as fault:
        return str(fault)


@settings(max_examples=some(40))
@given(share=st.floats(0.0, 1.0))
@example(share=0.0)
def test_one_that_was_cut_off_anywhere_is_read_to_its_last_whole_chunk(share: float) -> None:
    length = round(share * (chunk_ends()[-1][0] - 1))
    wanted = max((count for end, count in chunk_ends() if end <= length), default=0)
    found = outcome(whole()[:length])
    if isinstance(found, str):
        assert wanted == 0, "there are messages in it"
        assert found.endswith("expected a recording of iiwa-sim, in MCAP")
    else:
        assert found == (wanted, True)


@settings(max_examples=some(40))
@given(share=st.floats(0.0, 1.0), change=st.integers(1, 255))
def test_a_byte_that_is_wrong_costs_what_follows_it_at_most(share: float, change: int) -> None:
    place = min(round(share * len(whole())), len(whole()) - 1)
    data = bytearray(whole())
    data[place] ^= change
    wanted = max((count for end, count in chunk_ends() if end <= place), default=0)
    found = outcome(bytes(data))
    if isinstance(found, str):
        assert "\n" not in found
        assert wanted == 0
    else:
        assert found[0] >= wanted
