"""Access to the page over real sockets, and clients that send rubbish."""

from __future__ import annotations

import contextlib
import http.client
import socket
from collections.abc import Callable, Iterator
from http.client import HTTPMessage
from typing import Any

import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus

from iiwa_sim.view.access import open_page
from tests.line_client import DEADLINE_S, wait_until
from tests.view.viewer import Viewer, viewing

Page = tuple[viser.ViserServer, int]


@pytest.fixture
def page() -> Iterator[Page]:
    with socket.create_server(("127.0.0.1", 0)) as listening, open_page(listening) as (server, ready):
        ready.set()
        yield server, listening.getsockname()[1]


def get(port: int, path: str, **headers: str) -> tuple[int, bytes, HTTPMessage]:
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=DEADLINE_S)) as connection:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers


@pytest.mark.parametrize("host", ["localhost", "[::1]:8080", "192.168.1.7:8080"])
def test_a_browser_is_admitted_by_an_address_and_as_the_page_itself(page: Page, host: str) -> None:
    assert get(page[1], "/", Host=host, Origin=f"http://{host}")[0] == 200


@pytest.mark.parametrize(
    ("origin", "host"),
    [("http://evil.example", ""), ("", "evil.example"), ("http://localhost:1", ""), ("null", "")],
)
def test_pages_of_others_open_nothing(page: Page, origin: str, host: str) -> None:
    headers = {"Host": host} if host else {}
    with pytest.raises(InvalidStatus) as refused, viewing(page[1], origin or None, **headers):
        pass
    assert refused.value.response.status_code == 403


def test_a_browser_sends_the_token_once_and_then_a_cookie() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as listening,
        open_page(listening, "swordfish") as page,
    ):
        page[1].set()
        port = listening.getsockname()[1]
        for path in ("/", "/?token=sword"):
            status, body, headers = get(port, path)
            assert (status, headers["Content-Type"][:10]) == (401, "text/plain")
            assert b"?token=TOKEN" in body
        with pytest.raises(InvalidStatus), viewing(port, Cookie=f"iiwa-sim-{port}=sword"):
            pass
        status, _, headers = get(port, "/?token=swordfish", Host="robot.example")
        cookie, _, rest = headers["Set-Cookie"].partition(";")
        assert status == 303
        assert ("HttpOnly" in rest, "SameSite=Strict" in rest, "swordfish" in cookie) == (True, True, False)
        with viewing(port, Cookie=f"other=1; {cookie}") as viewer:
            viewer.until(lambda message: message["type"] == "ThemeConfigurationMessage")


def test_the_page_gets_clicks_and_is_not_shared(page: Page) -> None:
    server, port = page
    clicked: list[Any] = []
    server.gui.add_button("Click me").on_click(clicked.append)
    _, _, headers = get(port, "/")
    assert headers["Content-Security-Policy"] == "frame-ancestors 'self'"
    with viewing(port, f"http://127.0.0.1:{port}") as viewer:
        viewer.send(type="ShareUrlRequest")
        viewer.clicks("Click me")
        wait_until(lambda: clicked != [])
    assert server._share_tunnel is None


@pytest.mark.parametrize(
    "rubbish",
    [
        lambda viewer: viewer.connection.send("text"),
        lambda viewer: viewer.send(type="ViewerCameraMessage"),
        lambda viewer: viewer.connection.send(b"\xff" * 20),
    ],
    ids=["text", "no camera", "bytes"],
)
def test_a_client_that_sends_rubbish_is_dropped_and_others_are_served(
    page: Page, rubbish: Callable[[Viewer], None]
) -> None:
    server, port = page
    element = server.gui.add_html("before")
    with viewing(port) as other:
        with viewing(port) as viewer:
            with contextlib.suppress(ConnectionClosed):  # it may be dropped while it sends
                rubbish(viewer)
            assert viewer.is_closed()
        element.content = "after"
        other.shows("after")
