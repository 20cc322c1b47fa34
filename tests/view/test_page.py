"""The page's server over real sockets: whom it lets in, and what becomes of those who send rubbish."""

from __future__ import annotations

import contextlib
import gzip
import logging
import socket
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus

from iiwa_sim.server.token import Token
from iiwa_sim.view.page import open_page
from tests.talking import DEADLINE_S, wait_until
from tests.view.viewer import CAMERA, Viewer, viewing

Page = tuple[viser.ViserServer, int]


@pytest.fixture
def page() -> Iterator[Page]:
    with socket.create_server(("127.0.0.1", 0)) as listening, open_page(listening) as server:
        yield server, listening.getsockname()[1]


def fetch(port: int, path: str = "/", **headers: str) -> tuple[int, bytes, dict[str, str]]:
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers=headers)
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(request, timeout=DEADLINE_S) as answer:
            return answer.status, answer.read(), dict(answer.headers)
    except urllib.error.HTTPError as fault:
        with fault:
            return fault.code, fault.read(), dict(fault.headers)


def test_it_listens_only_at_the_socket_it_was_given(page: Page) -> None:
    server, port = page
    assert server.get_port() == port
    status, body, headers = fetch(port)
    assert status == 200
    assert b"<title>iiwa-sim</title>\n<style>" in body
    _, packed, headers = fetch(port, **{"Accept-Encoding": "gzip"})
    assert gzip.decompress(packed) == body
    assert headers["Content-Security-Policy"] == "frame-ancestors 'self'"


def test_it_shows_what_is_in_its_scene_and_hears_a_click(page: Page) -> None:
    server, port = page
    clicked: list[Any] = []
    server.gui.add_button("Push me").on_click(clicked.append)
    said = server.gui.add_html("before")
    with viewing(port, f"http://127.0.0.1:{port}") as viewer:
        viewer.clicks("Push me")
        viewer.send(type="ShareUrlRequest")  # is of no use, and ends nothing
        said.content = "after"
        viewer.until(lambda message: message.get("updates") == {"content": "after"})
        viewer.clicks("Push me")
        while len(clicked) < 2:
            said.content += "."
            viewer.until(lambda message: message.get("updates") == {"content": said.content})
    assert server._share_tunnel is None


@pytest.mark.parametrize(
    ("origin", "host"), [("http://evil.example", ""), ("", "evil.example"), ("http://localhost:1", "")]
)
def test_pages_of_others_open_nothing(page: Page, origin: str, host: str) -> None:
    _, port = page
    headers = {"Host": host} if host else {}
    with pytest.raises(InvalidStatus) as refused, viewing(port, origin or None, **headers):
        pass
    assert refused.value.response.status_code == 403


def test_with_a_token_nothing_is_told_without_it(caplog: pytest.LogCaptureFixture) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening, open_page(listening, Token("swordfish")):
        port = listening.getsockname()[1]
        status, body, headers = fetch(port)
        assert status == 401
        assert b"token" in body
        assert b"viser" not in body.lower()
        assert headers["Content-Type"].startswith("text/html")
        with pytest.raises(InvalidStatus), viewing(port):
            pass
        with viewing(port, Authorization="Bearer swordfish") as viewer:
            viewer.until(lambda message: message["type"] == "ThemeConfigurationMessage")
        assert fetch(port, "/?token=wrong")[0] == 401
    assert "swordfish" not in caplog.text


def floods(viewer: Viewer) -> None:
    for _ in range(400):
        viewer.send(**CAMERA)
    viewer.send(type="GuiUpdateMessage", uuid="nothing", updates={"value": 1, "update_cb": 2})


@pytest.mark.parametrize(
    "rubbish",
    [
        lambda viewer: viewer.connection.send("text"),
        lambda viewer: viewer.send(type="GuiUpdateMessage", uuid="a", updates={"update_cb": []}),
        lambda viewer: viewer.send(type="ViewerCameraMessage"),
        floods,
    ],
    ids=["text", "inner parts", "no camera", "flood"],
)
def test_who_sends_rubbish_is_dropped_and_others_see_on(
    page: Page,
    rubbish: Callable[[Viewer], None],
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    server, port = page
    said = server.gui.add_html("before")
    with caplog.at_level(logging.WARNING, "iiwa_sim"), viewing(port) as other:
        with viewing(port) as viewer:
            with contextlib.suppress(ConnectionClosed):  # who is dropped may still be sending
                rubbish(viewer)
            assert viewer.closed()
        said.content = "after"
        other.until(lambda message: message.get("updates") == {"content": "after"})
        wait_until(lambda: caplog.messages != [])  # the server tells it once the connection is closed
    assert len(caplog.messages) <= 2, caplog.messages
    assert all(line.startswith("page: ") and "\n" not in line for line in caplog.messages)
    assert capfd.readouterr().err == ""
