"""What listeners hear of a conversation."""

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.protocols.iiwa import IiwaSession
from tests.journal import Journal
from tests.protocols.fake_robot import FakeRobot
from tests.protocols.packets import cut

PLACE = "127.0.0.1:40000"
LINES = st.lists(
    st.sampled_from(["hello", "get status", "stop", "nonsense", "", "lin move : 1", "help : \u00fc"])
)


def heard_from(session: IiwaSession, robot: FakeRobot, packets: list[bytes]) -> bytes:
    replies = b""
    for packet in packets:
        session.receive(packet)
        while session.waiting:
            replies += session.answer()
            robot.tick += 1
    return replies


@given(data=st.data(), lines=LINES)
def test_every_line_is_told_with_its_reply_behind_it(data: st.DataObject, lines: list[str]) -> None:
    robot, heard = FakeRobot(), list[DialogueLine]()
    dialogue = Dialogue(lambda: robot.tick)
    dialogue.listeners.append(heard.append)
    session = IiwaSession(robot, Journal(), PLACE, dialogue)
    sent = "".join(f"{line}\r\n" for line in lines).encode()
    replies = heard_from(session, robot, data.draw(cut(sent)))
    session.lost()
    assert [said.session for said in heard] == [PLACE] * (2 * len(lines) + 2)
    assert (heard[0].direction, heard[0].text) == (Direction.EVENT, "connected")
    assert (heard[-1].direction, heard[-1].text) == (Direction.EVENT, "disconnected")
    asked, answered = heard[1:-1:2], heard[2:-1:2]
    assert {said.direction for said in asked} <= {Direction.FROM_CLIENT}
    assert {said.direction for said in answered} <= {Direction.TO_CLIENT}
    assert [said.text for said in asked] == [repr(line.encode())[2:-1] for line in lines]
    assert [said.text for said in answered] == replies.decode().splitlines()
    ticks, instants = [said.tick for said in heard], [said.instant_ns for said in heard]
    assert ticks == sorted(ticks)
    assert instants == sorted(instants)
