"""Who may open the page, over real sockets, and what happens to clients that send rubbish."""

from __future__ import annotations

import contextlib
import logging
import socket
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any

import msgspec
import pytest
import viser
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidStatus

from iiwa_sim.server.token import Token
from iiwa_sim.view.access import Admitted, Denied, Gate, Rubbish, check_message, open_page
from tests.talking import DEADLINE_S, wait_until
from tests.view.viewer import CAMERA, Viewer, viewing

Page = tuple[viser.ViserServer, int]
HERE = "localhost:8080"


@pytest.fixture
def page() -> Iterator[Page]:
    with socket.create_server(("127.0.0.1", 0)) as listening, open_page(listening) as server:
        yield server, listening.getsockname()[1]


def check(gate: Gate, path: str = "/", host: str = HERE, **headers: str) -> None:
    sent = {"host": [host], "origin": [], "cookie": [], "authorization": []}
    gate.check(path, sent | {name: [value] for name, value in headers.items()}, 8080)


def fetch(port: int, path: str = "/") -> tuple[int, bytes, dict[str, str]]:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(f"http://127.0.0.1:{port}{path}", timeout=DEADLINE_S) as answer:
            return answer.status, answer.read(), dict(answer.headers)
    except urllib.error.HTTPError as fault:
        with fault:
            return fault.code, fault.read(), dict(fault.headers)


def test_the_token_is_sent_once_and_a_cookie_stands_for_it() -> None:
    gate = Gate(Token("swordfish"))
    for path in ("/", "/?token=sword"):
        with pytest.raises(Denied, match="token") as denied:
            check(gate, path)
        assert denied.value.status is HTTPStatus.UNAUTHORIZED
        assert 'name="token"' in denied.value.page
    with pytest.raises(Admitted) as admitted:
        check(gate, "/?token=swordfish", host="robot.example")
    cookie, _, rest = admitted.value.cookie.partition(";")
    assert "HttpOnly" in rest
    assert "SameSite=Strict" in rest
    assert "swordfish" not in cookie
    check(gate, cookie=f"other=1; {cookie}", host="robot.example")
    check(gate, authorization="Bearer swordfish")
    for headers in ({"cookie": cookie}, {"authorization": "Bearer sword"}):
        with pytest.raises(Denied):
            check(Gate(Token("swordfish")), **headers)  # the cookie is of another process


@pytest.mark.parametrize("host", [HERE, "127.0.0.1:8080", "[::1]:8080", "192.168.1.7:8080"])
def test_a_browser_is_admitted_by_an_address_and_as_the_page_itself(host: str) -> None:
    check(Gate(None), host=host)
    check(Gate(None), host=host, origin=f"http://{host}")


@pytest.mark.parametrize(
    ("origin", "host"),
    [("http://evil.example", ""), ("", "evil.example"), ("http://localhost:1", ""), ("null", "")],
)
def test_pages_of_others_open_nothing(page: Page, origin: str, host: str) -> None:
    headers = {"Host": host} if host else {}
    with pytest.raises(InvalidStatus) as refused, viewing(page[1], origin or None, **headers):
        pass
    assert refused.value.response.status_code == 403


def test_with_a_token_nothing_is_shown_without_it(caplog: pytest.LogCaptureFixture) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening, open_page(listening, Token("swordfish")):
        port = listening.getsockname()[1]
        status, body, headers = fetch(port)
        assert (status, headers["Content-Type"][:9]) == (401, "text/html")
        assert b"viser" not in body.lower()
        with pytest.raises(InvalidStatus), viewing(port):
            pass
        with viewing(port, Authorization="Bearer swordfish") as viewer:
            viewer.until(lambda message: message["type"] == "ThemeConfigurationMessage")
    assert "swordfish" not in caplog.text


def test_it_hears_a_click_and_drops_messages_without_use(page: Page) -> None:
    server, port = page
    clicked: list[Any] = []
    server.gui.add_button("Click me").on_click(clicked.append)
    _, body, headers = fetch(port)
    assert b"<title>iiwa-sim</title>" in body
    assert headers["Content-Security-Policy"] == "frame-ancestors 'self'"
    with viewing(port, f"http://127.0.0.1:{port}") as viewer:
        viewer.send(type="ShareUrlRequest")
        viewer.clicks("Click me")
        wait_until(lambda: clicked != [])
    assert server._share_tunnel is None


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
    ids=["text", "attribute", "no camera", "flood"],
)
def test_a_client_that_sends_rubbish_is_dropped_and_others_see_on(
    page: Page, rubbish: Callable[[Viewer], None], caplog: pytest.LogCaptureFixture
) -> None:
    server, port = page
    element = server.gui.add_html("before")
    with caplog.at_level(logging.WARNING, "iiwa_sim"), viewing(port) as other:
        with viewing(port) as viewer:
            with contextlib.suppress(ConnectionClosed):  # it may be dropped while it sends
                rubbish(viewer)
            assert viewer.is_closed()
        element.content = "after"
        other.shows("after")
        wait_until(lambda: caplog.messages != [])
    assert len(caplog.messages) <= 2, caplog.messages
    assert all(line.startswith("page: ") and "\n" not in line for line in caplog.messages)


@given(st.binary(max_size=200) | st.dictionaries(st.text(), st.integers()).map(msgspec.msgpack.encode))
def test_all_bytes_are_a_message_or_rubbish(raw: bytes) -> None:
    with contextlib.suppress(Rubbish):
        assert check_message(raw) in (True, False)
