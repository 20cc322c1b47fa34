"""`iiwa-sim --view-port` and `iiwa-sim view`, as processes."""

from __future__ import annotations

import signal
import socket
import urllib.request
from collections.abc import Sequence

import pytest

from tests.processes import IIWA_SIM, refused, running, started
from tests.talking import DEADLINE_S
from tests.view.viewer import viewing


def page_port(lines: Sequence[str]) -> int:
    (url,) = [line.removeprefix("page on ") for line in lines if line.startswith("page on ")]
    return int(url.rstrip("/").rpartition(":")[2])


def test_the_page_comes_with_the_robot_and_goes_with_it() -> None:
    with running("--view-port", "0") as simulator:
        port = page_port([simulator.line().strip() for _ in range(3)])
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(f"http://127.0.0.1:{port}/", timeout=DEADLINE_S) as page:
            assert b"<html" in page.read()
        with viewing(port) as viewer:
            viewer.labelled("Emergency stop")
        assert simulator.ends(signal.SIGTERM) == (0, "")
        with pytest.raises(OSError, match="refused"):
            socket.create_connection(("127.0.0.1", port), DEADLINE_S)


@pytest.mark.slow
def test_a_page_of_its_own_shows_a_robot_elsewhere() -> None:
    with running("--status-port", "0") as simulator:
        status = simulator.line().split()[-1]
        with started(*IIWA_SIM, "view", status, "--port", "0") as page:
            with viewing(page_port([page.line().strip()])) as viewer:
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
