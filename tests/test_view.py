"""`iiwa-sim --view-port` and `iiwa-sim show`: what cannot be served."""

from __future__ import annotations

import socket
from collections.abc import Sequence

import pytest

from tests.processes import refused


def test_a_port_that_is_taken_is_told_in_one_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        told = refused("--port", "0", "--view-port", port)
        assert f"cannot listen on 127.0.0.1:{port}: Address already in use" in told


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--view-host", "::1"], "--view-host: expected --view-port with it"),
        (["--view-port", "0", "--view-host", "0.0.0.0"], "--view-token or --view-token-file with it"),
        (["show", "run.mcap", "--host", "0.0.0.0"], "--host: no such option"),
    ],
)
def test_what_cannot_be_served_is_told_in_one_line(options: Sequence[str], told: str) -> None:
    assert told in refused(*options)
