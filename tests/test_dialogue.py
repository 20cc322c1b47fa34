"""The dialogue log: asked for by tests, reported, and read by the backdoor."""

from __future__ import annotations

import pytest

from iiwa_sim.dialogue import Dialogue, Direction, Exchange
from iiwa_sim.protocols.protocols import command_names


class Robot:
    """A dialogue in which a tick passes with each exchange."""

    def __init__(self) -> None:
        self._tick = 0
        self.dialogue = Dialogue(lambda: self._tick * 0.002, command_names)
        self.dialogue.remember()

    def say(self, line: str, reply: str, command: str = "", session: str = "driver") -> None:
        self._tick += 1
        self.dialogue.exchange(session, line, reply, command=command)

    def report(self) -> list[str]:
        """Without times."""
        return [line[21:] for line in self.dialogue.report().splitlines()[1:]]


@pytest.fixture
def robot() -> Robot:
    return Robot()


def test_commands_lines_and_exchanges_of_a_dialogue(robot: Robot) -> None:
    robot.dialogue.event("driver", "connected", "iiwa")
    robot.say("hello", "hello", "hello")
    robot.say("Lin  MOVE:450 200 520 0 -1.57 0 0.5 0", "done", "lin move")
    robot.say("lin mvoe : 1", "unknown command")
    dialogue = robot.dialogue
    assert dialogue.commands() == ["hello", "lin move", "lin mvoe : 1"]
    assert dialogue.exchanges()[1].line == "Lin  MOVE:450 200 520 0 -1.57 0 0.5 0"
    assert dialogue.exchanges()[0] == Exchange("driver", "hello", "hello", "hello")
    dialogue.assert_said("LIN move", times=1)
    dialogue.assert_said("lin move : 450 200 520 0 -1.57 0 0.5 0")
    dialogue.assert_said("stop", times=0)
    dialogue.forget()
    assert dialogue.commands() == []


@pytest.mark.parametrize(
    ("what", "times", "message"),
    [
        ("stop", None, "expected 'stop' at least once, was said 0 times; commands: get status .3 times."),
        ("hello", 2, "expected 'hello' 2 times, was said 1 times"),
        ("get status", 0, "expected 'get status' 0 times, was said 3 times"),
    ],
)
def test_a_failed_assertion_lists_the_commands(
    robot: Robot, what: str, times: int | None, message: str
) -> None:
    robot.say("hello", "hello", "hello")
    for _ in range(3):
        robot.say("get status", "moving", "get status")
    with pytest.raises(AssertionError, match=message):
        robot.dialogue.assert_said(what, times)


def test_a_misspelt_command_is_an_error(robot: Robot) -> None:
    with pytest.raises(ValueError, match="'lin mvoe': expected the name of a command"):
        robot.dialogue.assert_said("lin mvoe", times=0)
    robot.say("lin mvoe", "unknown command")
    robot.dialogue.assert_said("lin mvoe", times=1)


def test_the_report_has_repeated_polls_once_with_their_count(robot: Robot) -> None:
    robot.say("lin move : 1", "done")
    for _ in range(1000):
        robot.say("get status", "moving", "get status")
    robot.say("get status", "stopped", "get status")
    lines = robot.report()
    assert lines[:3] == ["driver > lin move : 1", "       < done", "driver > get status"]
    assert lines[3] == "       < moving  (1000 times)"
    assert lines[4:] == ["driver > get status", "       < stopped"]
    robot.dialogue.assert_said("get status", times=1001)


def test_the_report_shows_wire_faults_behind_their_replies(robot: Robot) -> None:
    robot.say("get status", "moving")
    robot.dialogue.event("driver", "nothing", mark=Direction.ON_WIRE)
    assert robot.report() == ["driver > get status", "       < moving", "driver ~ nothing"]
