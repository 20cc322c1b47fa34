"""Files of recordings: full disks, slow files, and files that are cut off."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from mcap.reader import make_reader

from iiwa_sim.recordings.read import Recording
from iiwa_sim.recordings.schemas import LOG
from iiwa_sim.recordings.writer import Message, Writer
from tests.line_client import DEADLINE_S, wait_until
from tests.recordings.recorded import FAR, Robot, contents, states_by_now

HEAD = {"version": "1", "rate_hz": "500"}


def block(count: int) -> list[Message]:
    return [(LOG, b"{}", number, number) for number in range(count)]


def test_a_disk_that_fills_up_ends_the_recording_with_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    robot = Robot(tmp_path / "run.mcap")
    writer = robot.recorder.out
    writer._stream.close()  # the next chunk cannot be written
    robot.goes_to(*FAR)
    robot.step(500)
    writer.close()
    errors = [record for record in caplog.records if record.levelno >= logging.ERROR]
    assert len(errors) == 1
    assert "the recording ends here" in errors[0].getMessage()


def test_blocks_without_room_are_dropped_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("iiwa_sim.recordings.writer.MOST_BLOCKS", 2)
    path, goes_on = tmp_path / "run.mcap", threading.Event()

    def slowly(messages: list[Message]) -> list[Message]:
        goes_on.wait(DEADLINE_S)
        return messages

    writer = Writer(path, HEAD, {})
    writer.put(block(1), slowly)
    wait_until(writer._blocks.empty)
    for _ in range(4):
        writer.put(block(10), slowly)
    goes_on.set()
    writer.close()
    assert len(contents(path, LOG)) == 21
    with path.open("rb") as file:
        metadata = {each.name: each.metadata for each in make_reader(file).iter_metadata()}
    assert metadata["iiwa_sim_end"] == {"lost_messages": "20"}
    (record,) = caplog.records
    assert record.getMessage().endswith(": the recording has lost 20 messages")


def test_a_killed_robot_leaves_a_file_that_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    command = [sys.executable, "-m", "iiwa_sim", "--port", "0", "--record", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as server:
        wait_until(lambda: len(states_by_now(path)) > 100)
        server.send_signal(signal.SIGKILL)
    recorded = Recording(path)
    ticks = [state.tick for state in recorded.contents("/state")]
    assert ticks == list(range(ticks[0], ticks[-1] + 1))
    assert recorded.cut_at_s is not None
