"""Who is let in to the page, and what a browser may say to it."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.server.token import Token
from iiwa_sim.view.gate import ALLOWED, Admitted, Denied, Gate, Rubbish, check_message

PORT = 8080
HERE = "localhost:8080"


def ask(gate: Gate, path: str = "/", host: str = HERE, **headers: str) -> None:
    given = {"host": [host], "origin": [], "cookie": [], "authorization": []}
    gate.check(path, given | {name: [value] for name, value in headers.items()}, PORT)


@pytest.mark.parametrize("host", [HERE, "127.0.0.1:8080", "[::1]:8080", "192.168.1.7:8080"])
def test_a_browser_is_let_in_by_an_address_and_as_its_own_page(host: str) -> None:
    ask(Gate(None), host=host)
    ask(Gate(None), host=host, origin=f"http://{host}")


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("evil.example:8080", "http://evil.example:8080"),  # a name that was made to point here
        (HERE, "http://evil.example"),
        (HERE, "http://localhost:3000"),
        (HERE, "null"),
    ],
)
@pytest.mark.parametrize("token", [None, "swordfish"])
def test_pages_of_others_are_not_let_in(host: str, origin: str, token: str | None) -> None:
    gate = Gate(None if token is None else Token(token))
    with pytest.raises(Denied) as denied:
        ask(gate, host=host, origin=origin)
    without_token = token is None or host == HERE
    assert denied.value.status is (HTTPStatus.FORBIDDEN if without_token else HTTPStatus.UNAUTHORIZED)


def test_the_token_is_told_once_and_a_cookie_stands_for_it() -> None:
    gate = Gate(Token("swordfish"))
    with pytest.raises(Denied, match="token") as denied:
        ask(gate)
    assert denied.value.status is HTTPStatus.UNAUTHORIZED
    assert 'name="token"' in denied.value.page
    with pytest.raises(Denied):
        ask(gate, "/?token=sword")
    with pytest.raises(Admitted) as admitted:
        ask(gate, "/?token=swordfish", host="robot.example")
    cookie, _, rest = admitted.value.cookie.partition(";")
    assert "HttpOnly" in rest
    assert "SameSite=Strict" in rest
    assert "swordfish" not in cookie
    ask(gate, cookie=f"other=1; {cookie}", host="robot.example")
    with pytest.raises(Denied):
        ask(Gate(Token("swordfish")), cookie=cookie)  # of another process
    ask(gate, authorization="Bearer swordfish")
    with pytest.raises(Denied):
        ask(gate, authorization="Bearer sword")


def message(kind: str, **more: Any) -> bytes:
    return msgspec.msgpack.encode({"type": kind, **more})


def test_messages_of_use_pass_and_others_are_left_out() -> None:
    assert check_message(message("ViewerCameraMessage", fov=1.0))
    assert check_message(message("GuiUpdateMessage", uuid="a", updates={"value": 1}))
    assert not check_message(message("ShareUrlRequest"))
    assert not check_message(message("RunJavascriptMessage", source=""))
    assert "ShareUrlRequest" not in ALLOWED


@pytest.mark.parametrize(
    "raw",
    [
        "text",
        b"",
        b"\xc1",
        msgspec.msgpack.encode([1]),
        message("GuiUpdateMessage", uuid="a", updates={"update_cb": []}),
        message("GuiUpdateMessage", uuid="a", updates=1),
        message("GuiUpdateMessage", uuid="a"),
        b"\x91" * 20_000,
    ],
)
def test_rubbish_is_told_from_messages(raw: str | bytes) -> None:
    with pytest.raises(Rubbish):
        check_message(raw)


@given(st.binary(max_size=200))
def test_whatever_comes_is_a_message_or_rubbish(raw: bytes) -> None:
    try:
        passes = check_message(raw)
    except Rubbish:
        return
    assert passes in (True, False)
