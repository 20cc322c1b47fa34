"""`iiwa-sim --view-port` and `iiwa-sim view`, as processes."""

from __future__ import annotations

import signal
import socket
from collections.abc import Sequence

import pytest

from tests.processes import IIWA_SIM, refused, running, started
from tests.view.viewer import viewing


@pytest.mark.slow
def test_a_page_of_its_own_shows_a_robot_elsewhere() -> None:
    with running("--status-port", "0") as simulator:
        status = simulator.line().split()[-1]
        with started(*IIWA_SIM, "view", status, "--port", "0") as page:
            with viewing(int(page.line().strip().rstrip("/").rpartition(":")[2])) as viewer:
                viewer.until(lambda message: "LBR iiwa 7 R800" in str(message.get("updates")))
            assert page.ends(signal.SIGINT) == (0, "")
        assert simulator.ends(signal.SIGTERM) == (0, "")


@pytest.mark.parametrize("command", [["--port", "0", "--view-port"], ["view", "127.0.0.1:1", "--port"]])
def test_a_port_that_is_taken_is_told_in_one_line(command: Sequence[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert f"cannot listen on 127.0.0.1:{port}: Address already in use" in refused(*command, port)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--view-host", "::1"], "--view-host: expected --view-port with it"),
        (
            ["--view-port", "0", "--view-host", "0.0.0.0"],
            "expected --view-token or --view-token-file with it",
        ),
        (["view", "127.0.0.1:1", "--host", "0.0.0.0"], "expected --token or --token-file with it"),
        (["show", "run.mcap", "--host", "0.0.0.0"], "expected --token or --token-file with it"),
        (["view", "h:1", "h:2", "--backdoor", "h:3"], "--backdoor: 1 given, expected one for each"),
        (["view", "30001"], "'30001' is not HOST:PORT"),
    ],
)
def test_what_cannot_be_served_is_told_in_one_line(options: Sequence[str], told: str) -> None:
    assert told in refused(*options)
