"""Truncated recordings are read up to the last whole chunk; other bytes are rejected in one line."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from hypothesis import example, given, settings
from hypothesis import strategies as st
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, breakup_chunk

from iiwa_sim.recordings import RecordingFault
from iiwa_sim.recordings.read import Recording
from iiwa_sim.recordings.schemas import CHANNELS
from tests.recordings.recorded import FAR, Robot
from tests.samples import some


@cache
def whole() -> bytes:
    """Return a recording of a second of motion, in some chunks."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        robot = Robot(path)
        robot.goes_to(*FAR)
        robot.step(600)
        robot.end()
        return path.read_bytes()


@cache
def chunk_ends() -> list[tuple[int, int]]:
    """Return the end of each chunk in the file, and the number of messages up to there."""
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


def outcome(data: bytes) -> tuple[int, bool] | str:
    """Return the number of messages in some bytes, and True for a cut; or their fault."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        path.write_bytes(data)
        try:
            recorded = Recording(path)
            return sum(1 for _ in recorded.messages(CHANNELS)), recorded.cut_at_s is not None
        except RecordingFault as fault:
            return str(fault)


@settings(max_examples=some(60))
@given(share=st.floats(0.0, 1.0), change=st.none() | st.integers(1, 255))
@example(share=0.0, change=None)
def test_a_cut_or_a_wrong_byte_loses_later_messages_only(share: float, change: int | None) -> None:
    place = min(round(share * len(whole())), len(whole()) - 1)
    data = bytearray(whole()[:place] if change is None else whole())
    if change is not None:
        data[place] ^= change
    wanted = max((count for end, count in chunk_ends() if end <= place), default=0)
    found = outcome(bytes(data))
    if isinstance(found, str):
        assert "\n" not in found
        assert wanted == 0, "there are messages in it"
    elif change is None and place < chunk_ends()[-1][0]:
        assert found == (wanted, True)
    else:
        assert found[0] >= wanted
