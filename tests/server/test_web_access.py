"""Access to ports that web pages can reach."""

from __future__ import annotations

import pytest

from iiwa_sim.server.web_access import WebAccess

HERE = ["127.0.0.1:9090"]


@pytest.mark.parametrize("host", ["127.0.0.1:9090", "localhost", "[::1]:9090", "robot.localhost:1"])
def test_requests_by_address_or_localhost_are_admitted(host: str) -> None:
    assert WebAccess().refusal([host], []) is None


@pytest.mark.parametrize("origin", ["http://localhost:3000", "https://127.0.0.1", "http://[::1]:8080"])
def test_pages_of_this_machine_are_admitted(origin: str) -> None:
    assert WebAccess().refusal(HERE, [origin]) is None


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost.evil.example", "x\x1b[2J", ""]
)
def test_pages_of_other_sites_are_rejected_in_one_line(origin: str) -> None:
    reason = WebAccess().refusal(HERE, [origin])
    assert reason is not None
    assert reason.isprintable()
