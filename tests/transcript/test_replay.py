"""Transcripts replayed over sockets: deviations have their line, and every wait ends."""

from __future__ import annotations

import asyncio
import socket

from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import read
from iiwa_sim.transcript.replay import replay


async def played(text: str, port: int, timeout_s: float = 30.0) -> list[tuple[int, str]]:
    """Return the deviations, by line."""
    transcript = read("one", text)
    found = await asyncio.to_thread(lambda: list(replay(transcript, "127.0.0.1", port, timeout_s)))
    return [(each.line, str(each)) for each in found]


async def test_every_deviation_is_reported_with_its_line(simulator: Simulator) -> None:
    text = "# all wrong\n> hello\n< bye\n> get status\n< stopped\n\n> get mode\n< normal\n> a\\q\n<?\n"
    assert await played(text, simulator.port) == [
        (3, "'hello': expected 'bye', got 'hello'"),
        (8, "'get mode': expected 'normal', got 'unknown'"),
        (9, "'a\\q': no escape: b'\\\\q'"),
    ]


async def test_several_clients_talk_to_one_robot(simulator: Simulator) -> None:
    text = (
        "a> get joint position\na<~inf 0 0 0 0 0 0 0\n"
        "a> joint move : {get joint position + 0.3 0 0 0 0 0 0} 0.5 0.5 0.5 0.5 0.5 0.5 0.5\na< done\n"
        "b> get status\nb< moving\n"
        "a leaves\n"
        "b wait stopped\n"
        "b> get distance to goal\nb< 0.0\n"
        "b> get joint position\nb<~0.29 0 0.52 0 -1.05 0 1.57 0\n"
    )
    assert await played(text, simulator.port) == [], "the robot stopped when its client left"


async def test_a_server_that_closes_ends_the_replay(simulator: Simulator) -> None:
    found = await played("> bye\n< bye\n> hello\n< hello\n> hello\n< hello\n", simulator.port)
    assert len(found) == 1
    assert found[0][0] in (3, 4)
    assert "connection" in found[0][1].lower()


async def test_a_silent_server_ends_the_replay() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        found = await played("> hello\n< hello\n> hello\n< hello\n", silent.getsockname()[1], 0.05)
    assert found == [(2, "'hello': no reply within 0.05 s")]


async def test_lines_with_times_are_sent_at_their_time(simulator: Simulator) -> None:
    lines: list[tuple[str, int]] = []
    simulator.dialogue.listeners.append(lambda line: lines.append((line.text, line.instant_ns)))
    text = "[0.2 0.0] > hello\n[0.2 0.0] < hello\n[0.3 0.0] > get status\n[0.3 0.0] < stopped\n"
    began = asyncio.get_running_loop().time()
    assert await played(text, simulator.port) == []
    at = {text: instant_ns * 1e-9 for text, instant_ns in lines}
    assert at["stopped"] - began >= 0.3
    assert at["hello"] - began >= 0.2
