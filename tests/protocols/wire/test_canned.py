"""What is answered in place of the robot."""

from __future__ import annotations

import pytest

from iiwa_sim.protocols.faults import CannedReplies


def test_replies_take_the_lines_of_their_command_in_turn() -> None:
    canned = CannedReplies()
    assert not canned.any
    canned.set("Get  STATUS", "moving", times=2)
    canned.set("get status", "error")
    assert [canned.take("get status") for _ in range(4)] == ["moving", "moving", "error", None]
    assert canned.take("stop") is None
    assert not canned.any


def test_a_reply_without_a_number_stays_until_it_is_cleared() -> None:
    canned = CannedReplies()
    canned.set("stop", "error", times=0)
    assert {canned.take("stop") for _ in range(100)} == {"error"}
    canned.clear()
    assert canned.take("stop") is None
    assert not canned.any


@pytest.mark.parametrize(
    ("command", "reply", "times", "message"),
    [
        ("get statsu", "moving", 1, "'get statsu': expected a command of .*; did you mean get status"),
        ("get status : 1", "moving", 1, "'get status : 1': expected a command of the robot's port"),
        ("stop", "do\nne", 1, r"reply 'do\\nne': expected one line of printable ASCII"),
        ("stop", "f\xfcr", 1, "expected one line of printable ASCII"),
        ("stop", "done", -1, "times=-1: expected 0 or more"),
    ],
)
def test_what_makes_no_sense_is_told_and_not_set(command: str, reply: str, times: int, message: str) -> None:
    canned = CannedReplies()
    with pytest.raises(ValueError, match=message):
        canned.set(command, reply, times)
    assert not canned.any
