"""Replies of the iiwa's protocol: none is longer than a driver receives at once."""

from __future__ import annotations

import pytest

from iiwa_sim.cell.settings import LARGEST_IO_COUNT
from iiwa_sim.contact.noise import Noise
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.io import Io
from iiwa_sim.protocols.iiwa import LONGEST_REPLY
from iiwa_sim.protocols.table import load_table
from iiwa_sim.robot.description import load_robot
from tests.protocols.fake_robot import Conversation

TABLE = load_table("iiwa")
FRAME = "450 0 520 0 -1.57 0"
SEVEN = "0 0.5 0 -1 0 1.5 0"
ONES = "1 1 1 1 1 1 1"


def worst_lines() -> list[str]:
    """Return lines of each command: alone, with help, with the longest numbers, with other words."""
    lines = ["help", "help : move", "help : e", "help : 3040"]
    lines += ["", ":", "x" * 4000, "get error" + " x" * 1000]
    for name, command in TABLE.commands.items():
        if name == "bye":
            continue
        count = len(command.parameters) + len(command.optional)
        lines += [name, f"help : {name}", f"help : {name[1:]}"]
        lines += [f"{name} : {'9' * 3900}", f"{name} : {'x' * 3900}"]
        for number in ("0", "1", "-0.123456789012345", "1e308", "9" * 200, "\\xff" * 90, "1,5"):
            lines += [f"{name} : {' '.join([number] * some)}" for some in (1, count, count + 1)]
    return lines


def test_no_reply_is_longer_than_a_driver_receives_at_once() -> None:
    io = Io(*([f"{kind} {n}" for n in range(LARGEST_IO_COUNT)] for kind in ("input", "output")))
    robot = Controller(load_robot(), 0.002, io=io, noise=Noise(1, 1e5, 1e5, 1e5, 7))
    talk = Conversation(robot)
    robot.load.wrench = (-123456.123456789,) * 6
    robot.load.joint_push = (-123456.123456789,) * 7
    longest = 0
    for line in worst_lines():
        for asked in (line, "get error"):
            reply = talk.ask(asked)
            longest = max(longest, len(reply))
            assert len(reply) + 2 <= LONGEST_REPLY, (asked, reply)
        robot.stop()
        robot.step()
    assert longest > 400, "help is among them"


@pytest.mark.parametrize(
    ("line", "count"),
    [
        (f"joint move : {SEVEN} {ONES} 10", 1),
        (f"lin move : {FRAME} 0.5 0 1 2", 2),
        (f"is reachable : {FRAME} 0 0", 1),
        ("set override : 0.5 0.5", 1),
    ],
)
def test_surplus_values_are_ignored_and_logged_once_for_each_command(line: str, count: int) -> None:
    talk = Conversation(Controller(load_robot(), 0.002))
    wanted = "reachable" if line.startswith("is") else "done"
    assert [talk.ask(line) for _ in range(3)] == [wanted] * 3
    ((client, command, remark),) = talk.journal.remarks
    assert (client, command) == ("client", line.partition(" :")[0])
    assert remark.startswith(f"ignores {count} more than ")
    other = Conversation(talk.robot, talk.journal, "another")
    other.ask(line)
    assert len(talk.journal.remarks) == 2, "once for each client"
    assert not talk.journal.refusals


def test_a_strict_server_rejects_surplus_values_and_names_the_expected_ones() -> None:
    talk = Conversation(Controller(load_robot(), 0.002), strict=True)
    assert talk.ask(f"joint move : {SEVEN} {ONES} 10") == "error"
    assert talk.ask("get error") == "3040 joint move takes j0..j6 v0..v6: 14 values, got 15"
    assert talk.ask("get status") == "stopped"
    assert talk.ask(f"joint move : {SEVEN} {ONES}") == "done"
    assert talk.journal.remarks == []
