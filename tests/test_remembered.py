"""What a driver has said, asked for afterwards."""

from __future__ import annotations

import pytest

from iiwa_sim import remembered
from iiwa_sim.protocols.ports import IIWA, KRC4
from iiwa_sim.remembered import Exchange, RememberedDialogue


@pytest.fixture
def dialogue() -> RememberedDialogue:
    dialogue = RememberedDialogue(lambda: 0)
    dialogue.remember()
    dialogue.event("driver", "connected", IIWA)
    return dialogue


def test_commands_are_told_by_their_names_whatever_their_case_and_blanks(
    dialogue: RememberedDialogue,
) -> None:
    dialogue.exchange("driver", "hello", "hello")
    dialogue.exchange("driver", "Lin  MOVE:450 200 520 0 -1.57 0 0.5 0", "done")
    dialogue.exchange("driver", "lin mvoe : 1", "unknown command")
    assert dialogue.commands() == ["hello", "lin move", "lin mvoe : 1"]
    assert dialogue.lines()[1] == "Lin  MOVE:450 200 520 0 -1.57 0 0.5 0"
    assert dialogue.exchanges()[0] == Exchange("driver", "hello", "hello", "hello")
    dialogue.assert_said("LIN move", times=1)
    dialogue.assert_said("lin move : 450 200 520 0 -1.57 0 0.5 0")
    dialogue.assert_said("stop", times=0)


def test_messages_are_told_by_theirs(dialogue: RememberedDialogue) -> None:
    dialogue.event("other", "connected", KRC4)
    dialogue.exchange("other", "Cmd I0=1 I1=320", "Res I0=1 I1=320 R0=1")
    dialogue.exchange("other", "Cmd I0=2 I1=4711", "Res I0=2 I1=-4711 I2=3040")
    dialogue.exchange("other", '<Cmd I0="1"', "Res I1=0")
    dialogue.exchange("driver", "hello", "hello")
    assert dialogue.commands() == ["GOA", "Cmd I0=2 I1=4711", '<Cmd I0="1"', "hello"]
    dialogue.assert_said("goa")


def test_polls_are_counted(dialogue: RememberedDialogue) -> None:
    for _ in range(1000):
        dialogue.exchange("driver", "get status", "moving")
    dialogue.exchange("driver", "get status", "stopped")
    dialogue.assert_said("get status", times=1001)
    assert len(dialogue.exchanges()) == 1001


@pytest.mark.parametrize(
    ("what", "times", "message"),
    [
        ("stop", None, "expected 'stop' at least once, was said never; said were hello .once., get status"),
        ("hello", 2, "expected 'hello' 2 times, was said once"),
        ("get status", 0, "expected 'get status' never, was said 3 times"),
    ],
)
def test_what_was_not_said_fails_and_tells_what_was(
    dialogue: RememberedDialogue, what: str, times: int | None, message: str
) -> None:
    dialogue.exchange("driver", "hello", "hello")
    for _ in range(3):
        dialogue.exchange("driver", "get status", "moving")
    with pytest.raises(AssertionError, match=message):
        dialogue.assert_said(what, times)


def test_a_misspelt_command_is_no_command_that_was_never_said(dialogue: RememberedDialogue) -> None:
    with pytest.raises(ValueError, match="'lin mvoe': expected the name of a command"):
        dialogue.assert_said("lin mvoe", times=0)
    dialogue.exchange("driver", "lin mvoe", "unknown command")
    dialogue.assert_said("lin mvoe", times=1)


def test_what_is_forgotten_was_not_said(dialogue: RememberedDialogue) -> None:
    dialogue.exchange("driver", "hello", "hello")
    dialogue.forget()
    dialogue.exchange("driver", "stop", "done")
    assert dialogue.commands() == ["stop"]


def test_too_much_is_told_until_it_is_forgotten(
    dialogue: RememberedDialogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remembered, "MOST", 2)
    for line in ("hello", "stop", "hello"):
        dialogue.exchange("driver", line, line)
    with pytest.raises(RuntimeError, match="more than 2 exchanges"):
        dialogue.commands()
    dialogue.forget()
    assert dialogue.commands() == []


def test_nothing_is_remembered_unless_it_is_asked_for() -> None:
    dialogue = RememberedDialogue(lambda: 0)
    dialogue.exchange("driver", "hello", "hello")
    assert dialogue.listeners == []
    with pytest.raises(RuntimeError, match=r"call dialogue\.remember"):
        dialogue.commands()
