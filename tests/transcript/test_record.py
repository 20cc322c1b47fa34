"""Sessions recorded, read back and played again."""

from __future__ import annotations

import asyncio
import os
import re
from pathlib import Path

import pytest

from iiwa_sim.dialogue import Dialogue, DialogueLine
from iiwa_sim.protocols.faults import Drop
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Answered, Compare, Leaves, Said, Step, Wait, read_file
from iiwa_sim.transcript.record import Recorder
from iiwa_sim.transcript.replay import replay
from iiwa_sim.transcript.texts import TranscriptFault
from tests.talking import Client, until

MOVE = "joint move : 0 0.5 0 -1 0 1.5 0.2 1 1 1 1 1 1 1"


def recorder(path: Path, simulator: Simulator) -> Recorder:
    return Recorder(path, simulator.dialogue, simulator.controller.tick_s, "a robot")


async def test_a_recorded_session_plays_without_deviation_on_another_robot(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    async with Simulator() as simulator:
        with recorder(path, simulator):
            one, other = await Client.connect(simulator.port), await Client.connect(simulator.port)
            for line in ("hello", "get tool frame", "lin move : 1", "get error", "help : {lin}", "\t x\\y"):
                await one.ask(line)
            assert await other.ask(MOVE) == "done"
            assert await one.ask("get status") == "moving"
            await one.until_stopped()
            for line in ("get joint position", "get robot status", "get status"):
                await other.ask(line)
            await one.leaves()
            await until(lambda: " leaves" in path.read_text())
            await other.ask("bye")
            await other.leaves()
    transcript = read_file(path)
    assert {step.step.client for step in transcript.steps} == {"client1", "client2"}
    ends = [step for step in transcript.steps if isinstance(step, Answered)][-4:]
    compared = [(end.text.split()[-1], end.compare) for end in ends[:-1]]
    assert compared == [("0.2", Compare.NUMBERS), ("0", Compare.EXACT), ("stopped", Compare.EXACT)]
    # How often it polls until the robot is at rest is up to the machine: what follows waits for that.
    polls = {
        step.step.line + 1
        for step in transcript.steps
        if isinstance(step, Said) and (step.step.client, step.text) == ("client1", "get status")
    }
    at_rest = [step.step.line for step in transcript.steps].index(max(polls)) + 1
    wait = Wait(Step(0, "client1", None), None)
    transcript = transcript._replace(steps=(*transcript.steps[:at_rest], wait, *transcript.steps[at_rest:]))
    async with Simulator() as another:
        found = await asyncio.to_thread(
            lambda: list(replay(transcript, "127.0.0.1", another.port, timeout_s=30))
        )
    assert [each for each in found if each.line not in polls] == []


async def test_times_are_simulated_and_real(tmp_path: Path, simulator: Simulator) -> None:
    path = tmp_path / "session.txt"
    with recorder(path, simulator):
        client = await Client.connect(simulator.port)
        for _ in range(3):
            tick = simulator.controller.tick
            await until(lambda tick=tick: simulator.controller.tick > tick)
            await client.ask("hello")
        await client.leaves()
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    times = [tuple(map(float, re.match(r"\[(\S+) (\S+)\] ", line).groups())) for line in lines]
    assert times == sorted(times)
    assert len({simulated for simulated, _ in times}) >= 3
    assert times[-1][0] <= simulator.controller.tick * simulator.controller.tick_s + 1e-3


def test_what_happens_besides_is_a_comment(tmp_path: Path) -> None:
    dialogue = Dialogue(lambda: 500)
    path = tmp_path / "session.txt"
    with Recorder(path, dialogue, 0.002, "a robot"):
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
    assert [step.step.client for step in transcript.steps] == ["client1", "client1", "client2"]
    assert isinstance(transcript.steps[1], Leaves)


def test_a_full_disk_is_told_of_before_anything_is_said() -> None:
    dialogue = Dialogue(lambda: 0)
    with pytest.raises(TranscriptFault, match="/dev/full: cannot be written: No space left"):
        Recorder(Path("/dev/full"), dialogue, 0.002, "a robot")
    assert dialogue.listeners == []


def test_a_disk_that_fills_up_ends_the_recording_only(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    dialogue = Dialogue(lambda: 0)
    heard: list[DialogueLine] = []
    recorder = Recorder(tmp_path / "file", dialogue, 0.002, "a robot")
    with recorder:
        with Path("/dev/full").open("wb") as full:
            os.dup2(full.fileno(), recorder._descriptor)
        dialogue.listeners.append(heard.append)
        for _ in range(3):
            dialogue.exchange("127.0.0.1:4000", "hello", "hello")
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path / 'file'}: the transcript ends here: No space left on device"
    ]
    assert len(heard) == 6


async def test_what_a_fault_made_of_a_reply_is_a_comment(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    async with Simulator() as simulator:
        with recorder(path, simulator):
            client = await Client.connect(simulator.port)
            assert await client.ask("hello") == "hello"
            simulator.backdoor.set_fault(Drop(), replies=1)
            client.send(b"get mode\r\nget override\r\n")
            assert await client.reply() == "1.0"
            await client.leaves()
    (comment,) = [line for line in path.read_text().splitlines() if "on the wire" in line]
    assert re.fullmatch(r"# \[[\d. ]+\] client1: on the wire: nothing", comment)
    said = [step.text for step in read_file(path).steps if isinstance(step, Answered)]
    assert said == ["hello", "unknown", "1.0"], "what was answered"
