"""Sessions recorded, read back and played again."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.dialogue import Dialogue, DialogueLine
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Kind, read_file
from iiwa_sim.transcript.record import recorded
from iiwa_sim.transcript.replay import replay


def test_other_events_are_comments(tmp_path: Path) -> None:
    dialogue = Dialogue(lambda: 1.0)
    path = tmp_path / "session.txt"
    with recorded(path, dialogue, "a robot"):
        dialogue.event("127.0.0.1:4000", "connected", "iiwa")
        dialogue.exchange("127.0.0.1:4000", "(too long)", "error")
        dialogue.event("robot", "3040 no smart command for 0.2 s")
        dialogue.event("127.0.0.1:4000", "disconnected")
        dialogue.event("127.0.0.1:4000", "connected", "iiwa")
    dialogue.exchange("127.0.0.1:4000", "hello", "hello")
    assert dialogue.listeners == []
    text = path.read_text()
    assert text.startswith("# a robot\n# [simulated real] time in s\n[1.000 ")
    assert re.search(r"\n# \[1\.000 \S+\] robot: 3040 no smart command for 0\.2 s\n", text)
    assert re.search(r"\n# \[1\.000 \S+\] client1> \(too long\)\n", text)
    transcript = read_file(path)
    assert [step.client for step in transcript.steps] == ["client1", "client1", "client2"]
    assert transcript.steps[1].kind is Kind.LEAVES


def test_a_full_disk_ends_the_recording_only(caplog: pytest.LogCaptureFixture) -> None:
    dialogue = Dialogue(lambda: 0)
    lines: list[DialogueLine] = []
    with recorded(Path("/dev/full"), dialogue, "a robot"):
        dialogue.listeners.append(lines.append)
        for _ in range(3):
            dialogue.exchange("127.0.0.1:4000", "hello", "hello")
    assert [record.getMessage() for record in caplog.records] == [
        "/dev/full: the transcript is not whole: No space left on device"
    ]
    assert len(lines) == 6


def test_a_reply_with_a_backslash_is_the_same_when_it_is_played(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    with (
        Simulator(clock="stepped", transcript=path) as simulator,
        Iiwa(simulator.host, simulator.port) as robot,
        pytest.raises(CommandError, match=r"\\x80"),
    ):
        robot.command("set override", "\x80")
    with Simulator(clock="stepped") as another:
        assert list(replay(read_file(path), another.host, another.port)) == []
