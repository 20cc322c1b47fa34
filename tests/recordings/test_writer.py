"""Whoever puts a message into a recording waits for nothing; what ends the file costs little of it."""

from __future__ import annotations

import logging
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.recordings.mcap_file import Head, McapFile
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.schemas import STATE
from iiwa_sim.recordings.writer import MOST_BYTES, Message, Writer, as_they_are
from tests.processes import fails, killed_unless_done, running
from tests.recordings.recorded import FAR, contents
from tests.talking import DEADLINE_S, wait_until

HEAD = Head({"version": "0", "rate_hz": "500", "joints": "A1"}, {}, 0)
BIG = b'"' + b"x" * 65_534 + b'"'


def message(number: int, data: bytes = b"{}") -> Message:
    return Message(STATE, data, number, number)


class Slow(McapFile):
    """A file that takes nothing until it is told to."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, HEAD)
        self.path = path
        self.goes_on = threading.Event()
        self.asked = threading.Event()

    def add(self, topic: str, data: bytes, log_ns: int, publish_ns: int, number: int) -> None:
        self.asked.set()
        assert self.goes_on.wait(DEADLINE_S)
        super().add(topic, data, log_ns, publish_ns, number)


@pytest.fixture
def slow(tmp_path: Path) -> Slow:
    return Slow(tmp_path / "a.mcap")


def test_a_file_that_takes_nothing_holds_nobody_up(slow: Slow, caplog: pytest.LogCaptureFixture) -> None:
    writer = Writer(Path("a.mcap"), slow, as_they_are)
    writer.put(message(0))
    assert slow.asked.wait(DEADLINE_S)
    many = MOST_BYTES // len(BIG) + 100
    for number in range(many):  # would not come to an end if it waited
        writer.put(message(number, BIG))
    assert 100 <= writer.lost < many
    assert writer._waiting_bytes <= MOST_BYTES
    slow.goes_on.set()
    lost = writer.lost
    assert writer.close()
    told = [record.getMessage() for record in caplog.records]
    assert told == [
        "a.mcap: the recording loses messages: the file takes them too slowly",
        f"a.mcap: the recording has lost {lost} messages",
    ]
    recorded = Recorded(slow.path)
    assert sum(1 for _ in recorded.messages((STATE,))) == many + 1 - lost
    assert not recorded.cut


def test_in_haste_a_tick_waits_for_the_file_and_nothing_is_lost(slow: Slow) -> None:
    writer = Writer(Path("a.mcap"), slow, as_they_are)
    many = 3 * MOST_BYTES // len(BIG)
    slow.goes_on.set()
    for number in range(many):
        writer.put(message(number, BIG), can_wait=True)
    assert writer.close()
    assert writer.lost == 0
    assert sum(1 for _ in Recorded(slow.path).messages((STATE,))) == many


def test_in_haste_nobody_waits_for_ever(
    slow: Slow, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("iiwa_sim.recordings.writer.PATIENCE_S", 0.01)
    writer = Writer(Path("a.mcap"), slow, as_they_are)
    for number in range(2 * MOST_BYTES // len(BIG)):
        writer.put(message(number, BIG), can_wait=True)
    assert writer.lost
    assert not writer.close(), "and so does the end"
    assert caplog.records[-1].getMessage() == "a.mcap: the recording is cut off: the file takes nothing"
    slow.goes_on.set()
    writer._thread.join(DEADLINE_S)


def test_a_disk_that_fills_up_ends_the_recording_with_one_line(
    slow: Slow, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    writer = Writer(Path("a.mcap"), slow, as_they_are)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(slow, "flush", full)
    monkeypatch.setattr(slow, "finish", full)
    slow.goes_on.set()
    writer.put(message(0))
    writer._thread.join(0.0)
    writer.close()
    for number in range(100):
        writer.put(message(number))
    assert [record.getMessage() for record in caplog.records] == [
        "a.mcap: the recording ends here: No space left on device"
    ]
    assert caplog.records[0].levelno == logging.ERROR


# Runs the program with files that cannot grow beyond 200 kB, as on a disk that is nearly full.
LITTLE_ROOM = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
from iiwa_sim.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_the_robot_goes_on_where_the_disk_is_full(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    program = (sys.executable, "-c", LITTLE_ROOM)
    with running("--record", str(path), "--clock", "fast", program=program) as robot:
        assert robot.process.stderr is not None
        with Iiwa("127.0.0.1", robot.port) as driver:
            driver.joint_move(FAR, [0.2] * 7)
            driver.wait_until_stopped(DEADLINE_S)
            with killed_unless_done(robot.process):
                line = robot.process.stderr.readline()
            driver.joint_move([0, 0.5, 0, -1, 0, 1.5, 0], [1] * 7)
            driver.wait_until_stopped(DEADLINE_S)
        code, said = robot.ends(signal.SIGTERM)
    assert line.endswith(f"error {path}: the recording ends here: File too large\n")
    assert (code, said) == (0, "")
    recorded = Recorded(path)
    ticks = [state.tick for state in recorded.states()]
    assert recorded.cut
    assert ticks == list(range(len(ticks))) != []


def test_a_full_disk_from_the_start_is_told_at_once() -> None:
    told = fails("--port", "0", "--record", "/dev/full")
    assert told == "iiwa-sim: /dev/full: cannot be written: No space left on device\n"


def test_what_kills_the_process_costs_less_than_a_second(tmp_path: Path) -> None:
    """It is in the file once it is there: what was read of the file before the end is in it after."""
    path = tmp_path / "run.mcap"
    with running("--record", str(path)) as robot:
        wait_until(lambda: len(list(Recorded(path).states())) > 600)  # some chunks
        robot.process.send_signal(signal.SIGKILL)
        robot.process.wait(DEADLINE_S)
    recorded = Recorded(path)
    ticks = [state.tick for state in recorded.states()]
    assert recorded.cut
    assert ticks == list(range(len(ticks)))
    assert len(ticks) > 600


def test_what_was_recorded_is_in_the_file_soon_without_more(tmp_path: Path) -> None:
    """Also where too little is said to fill a chunk."""
    writer = Writer(Path("a.mcap"), McapFile(tmp_path / "a.mcap", HEAD), as_they_are)
    writer.put(message(0))
    wait_until(lambda: bool(list(Recorded(tmp_path / "a.mcap").messages((STATE,)))))
    assert writer.close()
    assert len(contents(tmp_path / "a.mcap", STATE)) == 1


def test_a_fault_of_ours_in_the_thread_is_told_and_leaves_the_robot_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def fails(_: Sequence[Message]) -> list[Message]:
        raise KeyError("ours")

    writer = Writer(Path("a.mcap"), McapFile(tmp_path / "a.mcap", HEAD), fails)
    writer.put(message(0))
    writer.close()
    writer.put(message(1))
    assert [record.getMessage() for record in caplog.records] == [
        "a.mcap: the recording ends here: internal error"
    ]
