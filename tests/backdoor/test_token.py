"""Who may use the backdoor from another machine."""

from __future__ import annotations

import pytest

from iiwa_sim.backdoor.session import BackdoorSession
from iiwa_sim.server.token import LONGEST, Token, is_loopback
from tests.backdoor.bench import Bench

TOKEN = Token("swordfish")


def test_a_token_fits_itself_only() -> None:
    assert TOKEN.fits(b"swordfish")
    assert not any(
        TOKEN.fits(given) for given in (b"", b"swordfis", b"swordfishes", b"Swordfish", b"\xff" * 9)
    )


@pytest.mark.parametrize("text", ["", "two words", "schlüssel", "x" * (LONGEST + 1)])
def test_what_is_no_token(text: str) -> None:
    with pytest.raises(ValueError, match="expected 1 to 256 of printable ASCII, no blanks") as caught:
        Token(text)
    assert text.strip() == "" or text.strip() not in str(caught.value)  # it may be a secret with a slip in it


def test_only_this_machine_reaches_a_loopback_address() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "127.0.0.2", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "192.168.0.1", "localhost.example")))


def session(bench: Bench) -> BackdoorSession:
    return BackdoorSession(bench.backdoor, bench.journal, "stranger", TOKEN)


def test_the_first_line_is_the_token() -> None:
    bench = Bench()
    known = session(bench)
    known.receive(b"swordfish\r\nemergency stop\r\n")
    assert known.answer() == b"done\r\ndone\r\n"
    assert bench.controller.last_error is not None


@pytest.mark.parametrize("first", [b"emergency stop", b"swordfis", b""])
def test_anything_else_ends_the_connection_and_does_nothing(first: bytes) -> None:
    bench = Bench()
    stranger, before = session(bench), bench.seen()
    stranger.receive(first + b"\r\nswordfish\r\nemergency stop\r\n")
    assert stranger.answer() == b"error 3040 the first line is not the token\r\n"
    assert stranger.closing
    assert not stranger.waiting
    stranger.receive(b"swordfish\r\n")
    assert stranger.answer() == b""
    assert bench.seen() == before
    assert first == b"" or first.decode() not in str(vars(bench.journal))
