"""Lines of the status port, and the lines that it accepts."""

import json

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.state import snapshot
from iiwa_sim.protocols.status import NOTHING_ELSE, StatusSession, status_line
from iiwa_sim.robot.description import load_robot
from tests.journal import Journal
from tests.protocols.fake_robot import Conversation, FakeRobot
from tests.protocols.packets import cut
from tests.states import state


class Reader:
    """A reader of the status port, and the robot behind it."""

    def __init__(self) -> None:
        self.robot = FakeRobot()
        self.journal = Journal()
        self.session = StatusSession([self.robot], self.journal, "reader")

    def sends(self, *packets: bytes) -> bytes:
        answered = b""
        for packet in packets:
            self.session.receive(packet)
            while self.session.waiting:
                answered += self.session.answer()
        return answered


@pytest.mark.requirement("FRA202")
@given(
    st.lists(st.sampled_from([b"stop", b"stopp", b"bye", b"joint move : 1", b"", b"\xff\xf4\xff\xfd\x06"])),
    st.data(),
)
def test_stop_lines_are_counted_among_other_bytes_in_any_packets(lines, data):
    reader = Reader()
    reader.sends(*data.draw(cut(b"".join(line + b"\n" for line in lines))))
    assert reader.robot.stops == lines.count(b"stop")
    assert reader.robot.moves == []


@pytest.mark.parametrize(
    "line",
    [
        b"get status",
        b"bye",
        b"\x1b[2J\xff\xffstop",
        b"stop now",
    ],
)
def test_other_lines_are_rejected_and_do_nothing(line):
    reader = Reader()
    assert reader.sends(line + b"\r\n") == b""
    assert (reader.robot.stops, reader.robot.moves) == (0, [])
    ((name, text, code, reason),) = reader.journal.refusals
    assert (name, code, reason) == ("reader", 3040, NOTHING_ELSE)
    assert text.isprintable()
    assert reader.robot.errors.last == ErrorRecord(3040, NOTHING_ELSE)


@pytest.mark.requirement("FRA201", "FRA007")
def test_lines_agree_with_the_main_port_at_every_tick():
    controller = Controller(load_robot(), 0.002)
    talk = Conversation(controller)
    assert state(status_line(controller))["tick"] == 0
    for line in [
        "smart joint move :" + " 0.3" * 14,
        "lin move : 1 2 3 4 5 6 1 0",
        "joint move :" + " 0.4" * 14,
        "stop",
    ]:
        talk.ask(line)
        for _ in range(15):
            controller.step()
            seen = state(status_line(controller))
            wanted = json.loads(msgspec.json.encode(snapshot(controller)))
            assert list(seen.items()) == list(wanted.items()), "to the last bit, and in that order"
            for asked in ("status", "mode"):
                assert seen[asked] == talk.ask(f"get {asked}")
            for asked in ("joint position", "flange frame", "tool frame", "cartesian force", "joint torque"):
                expected = [float(word) for word in talk.ask(f"get {asked}").split()]
                assert seen[asked.replace(" ", "_")] == pytest.approx(expected, abs=1e-9)
            error = seen["error"]
            assert f"{error['code']} {error['reason']}" == talk.ask("get error")
