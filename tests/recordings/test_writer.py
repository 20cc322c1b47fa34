"""Whoever puts a message into a recording waits for nothing, whatever becomes of its file."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.handed import Beginning, Frames, Ready, handed_in
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.schemas import LOG
from iiwa_sim.recordings.writer import MOST_BYTES, Writer
from tests.talking import DEADLINE_S, wait_until

METADATA = {"version": "0", "rate_hz": "500", "joints": "A1"}
BEGINNING = Beginning(robot_alone().description, METADATA, {}, 500, 0, 0)
BIG = b'"' + b"x" * 65_534 + b'"'


def message(number: int, data: bytes = b"{}") -> list[Ready]:
    return [Ready(LOG, data, number, number)]


def begun(path: Path) -> Writer:
    writer = Writer(path)
    writer.begin(BEGINNING)
    return writer


def logs_by_now(path: Path) -> int:
    """How many there are in a file that is being written, which may have nothing in it yet."""
    try:
        return sum(1 for _ in Recorded(path).messages((LOG,)))
    except RecordingFault:
        return 0


class Other:
    """What stands for the process that writes: it takes nothing until it is told to."""

    number = 0
    hangs = False
    computed: int | None = None

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        ours, self.theirs = socket.socketpair()

        def given(_: Path, stream: BytesIO) -> tuple[Other, socket.socket]:
            self.stream = open(stream.fileno(), "wb", closefd=False)  # noqa: SIM115
            return self, ours

        monkeypatch.setattr("iiwa_sim.recordings.writer.given_to_write", given)

    def why_it_ended(self) -> str:
        return "it has ended"


@pytest.fixture
def other(monkeypatch: pytest.MonkeyPatch) -> Iterator[Other]:
    other = Other(monkeypatch)
    yield other
    other.theirs.close()


def logged(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records]


def test_a_file_that_takes_nothing_holds_nobody_up(
    other: Other, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "a.mcap"
    writer = begun(path)
    many = MOST_BYTES // len(BIG) + 200
    for number in range(many):  # would not come to an end if it waited
        writer.put(message(number, BIG))
    lost = writer.lost
    assert 100 <= lost < many
    assert writer._waiting_bytes <= MOST_BYTES
    taken: list[int] = []

    def takes() -> None:
        frames, whole = Frames(), []
        while data := other.theirs.recv(1 << 20):
            whole += frames.taken(data)
        for frame in whole[1:]:  # behind the beginning
            taken.extend(each.tick for each in handed_in(frame) if isinstance(each, Ready))
        other.theirs.send(b"whole\n")

    thread = threading.Thread(target=takes)
    thread.start()
    assert writer.close()
    thread.join(DEADLINE_S)
    assert len(taken) == many - lost
    assert logged(caplog) == [
        f"{path}: the recording loses messages: the file takes them too slowly",
        f"{path}: the recording has lost {lost} messages",
    ]


def test_in_haste_a_tick_waits_for_the_file_and_nothing_is_lost(tmp_path: Path) -> None:
    writer = begun(tmp_path / "a.mcap")
    many = 3 * MOST_BYTES // len(BIG)
    for number in range(many):
        writer.put(message(number, BIG), can_wait=True)
    assert writer.close()
    assert writer.lost == 0
    recorded = Recorded(tmp_path / "a.mcap")
    assert [each.log_ns for each in recorded.messages((LOG,))] == [2_000_000 * k for k in range(many)]
    assert not recorded.cut


def test_in_haste_nobody_waits_for_ever(
    other: Other, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("iiwa_sim.recordings.writer.PATIENCE_S", 0.01)
    path = tmp_path / "a.mcap"
    other.theirs.send(b"\n")  # it is there
    writer = begun(path)
    wait_until(lambda: writer._signs > 0)
    for number in range(2 * MOST_BYTES // len(BIG)):
        writer.put(message(number, BIG), can_wait=True)
    assert writer.lost
    assert not writer.close(), "and so does the end"
    assert other.hangs, "so nobody waits for its end either"
    assert logged(caplog)[1:] == [f"{path}: the recording is cut off: the file takes nothing"]
    writer._listener.join(DEADLINE_S)
    assert len(logged(caplog)) == 2, "which is all that is said of it"


@pytest.mark.parametrize(
    ("leaves", "told"),
    [
        (lambda theirs: theirs.send(b"\n\nfault No space left on device\n"), "No space left on device"),
        (lambda theirs: theirs.close(), "it has ended"),
    ],
)
def test_what_ends_the_recording_is_one_line(
    other: Other,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    leaves: Callable[[socket.socket], object],
    told: str,
) -> None:
    path = tmp_path / "a.mcap"
    writer = begun(path)
    writer.put(message(0))
    leaves(other.theirs)
    writer._listener.join(DEADLINE_S)
    for number in range(100):
        writer.put(message(number, BIG))
    assert not writer.close()
    assert logged(caplog) == [f"{path}: the recording ends here: {told}"]
    assert caplog.records[0].levelname == "ERROR"
