"""What happens to the robot between commands: told in log, recordings and dialogue, once each."""

from __future__ import annotations

import logging

import pytest

from iiwa_sim.controller.endings import Contact
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.dialogue import Dialogue, DialogueLine
from iiwa_sim.frames import Frame
from iiwa_sim.robot_events import RobotEvents

CONTACT = Contact(7, "z", -12.5, 0.25, 10.0, Frame(450.0, 0.0, 120.0, 0.0, 1.5, 0.0))


def test_what_happens_to_the_robot_is_told_to_log_listeners_and_dialogue(
    caplog: pytest.LogCaptureFixture,
) -> None:
    dialogue, said, heard = Dialogue(lambda: 5), list[DialogueLine](), list[tuple[object, ...]]()
    dialogue.listeners.append(said.append)
    events = RobotEvents(dialogue)
    events.listeners.append(lambda *event: heard.append(event))
    events.tell(ErrorRecord(3040, "100 % odd"))
    events.tell(CONTACT)
    events.tell("link 4 touches table")
    events.part("the gripper holds part 'it'", False)
    events.part("part 'it' has slipped", True)
    texts = ["100 % odd", str(CONTACT), "link 4 touches table", "part 'it' has slipped"]
    assert [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING] == texts
    assert heard == [
        ("fault", "100 % odd", 0, 3040),
        ("contact", str(CONTACT), 7, 0),
        ("touch", "link 4 touches table", 0, 0),
        ("part", "the gripper holds part 'it'", 0, 0),
        ("part slips", "part 'it' has slipped", 0, 0),
    ]
    assert {line.session for line in said} == {"robot"}
    assert [said[0].text, said[1].text, said[4].text] == ["3040 100 % odd", str(CONTACT), texts[3]]
