"""A recording on the page, as a browser sees it: time line, dialogue and playback."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Iterator
from math import degrees, dist
from pathlib import Path

import pytest

from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.recordings.read import STEP_NS, Timeline
from iiwa_sim.recordings.schemas import STATE
from iiwa_sim.simulator import Simulator
from iiwa_sim.view.playback import run_playback
from tests.line_client import DEADLINE_S
from tests.processes import IIWA_SIM, started
from tests.view.viewer import Viewer, viewing

FAR = (1, 1, 1, -1.5, 1, 1, 1)
FAST = "10x"
STEP_S = 1e-9 * STEP_NS


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a move, and of a line that is refused after the last state that the page keeps."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    with (
        Simulator(clock="stepped", record=path) as simulator,
        Iiwa(simulator.host, simulator.port) as driver,
    ):
        driver.joint_move(FAR, [0.5] * 7)
        simulator.run_until_stopped()
        simulator.advance(0.118 - simulator.state().time_s % STEP_S)
        with pytest.raises(CommandError):
            driver.lin_move((2000, 0, 0, 0, 0, 0), 0.5, 0)
    return path


@pytest.fixture
def viewer(run: Path) -> Iterator[Viewer]:
    over = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        page = threading.Thread(target=run_playback, args=(listening, Timeline(run), over))
        page.start()
        try:
            with viewing(port) as viewer:
                yield viewer
        finally:
            over.set()
            page.join(DEADLINE_S)
    assert not page.is_alive()


def first_joint(run: Path, time_s: float) -> str:
    return f"{degrees(Timeline(run).last(STATE, time_s)[0].joint_position[0]):.2f}"


def test_the_time_line_shows_the_robot_as_it_was(run: Path, viewer: Viewer) -> None:
    viewer.shows("LBR iiwa 7 R800", ">0.00<")
    for time_s in (0.8, 0.5):
        wanted = first_joint(run, time_s)
        assert 1.0 < float(wanted) < 56.0, "in motion"
        before, state = Timeline(run).last(STATE, time_s, 2)
        speed_mm_s = dist(state.tool_frame[:3], before.tool_frame[:3]) / (state.time_s - before.time_s)
        viewer.clicks("Time (s)", time_s)
        viewer.shows(f">{wanted}<", "moving", f"TCP {speed_mm_s:.0f} mm/s")


def test_dialogue_and_events_are_shown_up_to_the_present_time(run: Path, viewer: Viewer) -> None:
    end_s = Timeline(run).end_s
    viewer.clicks("Time (s)", 0.5)
    viewer.shows("move begins 1")
    assert not any("refused" in str(message.get("updates", {}).get("content", "")) for message in viewer.seen)
    viewer.clicks("Time (s)", end_s)
    viewer.shows("refused (3021)", "move ends 1")
    viewer.shows("lin move : 2000", "3021")


def test_a_recording_plays_to_its_end(run: Path, viewer: Viewer) -> None:
    viewer.clicks("Speed", FAST)
    viewer.clicks("Play")
    viewer.shows(f">{first_joint(run, 1e6)}<", "stopped")


def test_the_command_serves_a_recording_and_ends_on_a_signal(run: Path) -> None:
    with started(*IIWA_SIM, "show", run, "--port", "0") as process:
        line = process.line()
        assert line.startswith("page on http://127.0.0.1:")
        with viewing(int(line.strip().rstrip("/").rpartition(":")[2])) as viewer:
            viewer.shows("LBR iiwa 7 R800")
        assert process.ends(signal.SIGTERM) == (0, "")
