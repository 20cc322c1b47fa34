"""KRC4 messages and their effect on the controller."""

from __future__ import annotations

from math import degrees

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.protocols.krc4 import Krc4Session
from iiwa_sim.robot.description import load_robot
from tests.journal import Journal
from tests.krc4_client import IDS, Reply, attributes, replies, request
from tests.stepped import SteppedRobot

SIX_AXES = "kr_6_r900_sixx"
AWAY_DEG = (20.0, -80.0, 80.0, 10.0, 60.0, -200.0)
ABOVE = (445.0, 100.0, 700.0, 180.0, 0.0, 180.0)  # X Y Z mm, A B C deg: the flange points down


class Krc4Conversation:
    """A conversation without sockets."""

    def __init__(self, controller: Controller) -> None:
        self.journal = Journal()
        self.session = Krc4Session(controller, self.journal, "a test")

    def sends(self, wire: bytes) -> list[Reply]:
        """Send bytes; return the replies."""
        self.session.receive(wire)
        return self.receives()

    def receives(self) -> list[Reply]:
        answered = b""
        while self.session.waiting:
            answered += self.session.answer()
        assert all((line + reason).isprintable() for _, line, _, reason in self.journal.refusals)
        return replies(answered)

    def ask(self, tag: str, *reals: float, **integers: int) -> Reply:
        (reply,) = self.sends(request(7, tag, *reals, **integers))
        assert reply.id == 7
        assert abs(reply.command) == IDS[tag]
        return reply


def at_home(robot: str = SIX_AXES) -> tuple[SteppedRobot, Krc4Conversation]:
    stepped = SteppedRobot(robot)
    return stepped, Krc4Conversation(stepped.controller)


@given(st.sampled_from(["lbr_iiwa_7_r800", SIX_AXES]), st.integers(0, 10_000))
def test_joints_from_goa_are_accepted_by_pta(robot: str, seed: int) -> None:
    description = load_robot(robot)
    controller = Controller(description, 0.002)
    rng = np.random.default_rng(seed)
    joints = np.degrees(rng.uniform(description.position_min, description.position_max)).tolist()
    joints[0] = round(degrees(description.position_max[0]), 9)
    talk = Krc4Conversation(controller)
    assert talk.ask("PTA", *joints).error is None
    while controller.moving:
        controller.step()
    present = talk.ask("GOA").reals[: len(joints)]
    assert present == pytest.approx(joints, abs=1e-8)
    assert talk.ask("PTA", *present).error is None


def test_attributes_and_elements_are_equivalent_and_absent_values_are_0() -> None:
    _, talk = at_home()
    assert talk.sends(attributes("Cmd", {"I0": 5, "I1": 100})) == talk.sends(
        b"<Cmd><I0> 5 </I0><I1>\n100</I1></Cmd>"
    )
    assert talk.sends(b"<Cmd I1='100'/>")[0].id == 0
    (reply,) = talk.sends(b"<Cmd I0='-12' I1='25'/>")  # all joints at zero
    assert (reply.id, reply.command) == (-12, 25)


SENSELESS: list[tuple[bytes, int, int]] = [
    # the message, and the ids in its reply
    (b"<Cmd/>", 0, 0),
    (b"<Cmd I0='4'/>", 4, 0),
    (b"<Cmd I0='4' I1='77'/>", 4, -77),
    (b"<Cmd I0='4' I1='20' R0='a'/>", 4, -20),
    (b"<Cmd I0='4' I1='20' R10='1'/>", 4, -20),
    (b"<Cmd I0='4.0' I1='1'/>", 0, -1),
    (b"<Cmd I0='2147483648' I1='1'/>", 0, -1),
    (b"<Cmd I0='" + b"9" * 5000 + b"' I1='1'/>", 0, -1),
    ("<Cmd I0='\u0663' I1='1'/>".encode(), 0, -1),
    (b"<cmd I0='4' I1='1'/>", 4, -1),
    (b"<Cmd I0='4' I1='1'>STO</Cmd>", 4, -1),
    (b"<Cmd><I0>4</I0><I1>1</I1><I1>1</I1></Cmd>", 4, -1),
    (b"<Cmd><I0>4</I0><I1>1</I1><I2><R0>1</R0></I2></Cmd>", 4, -1),
]


def test_wrong_messages_are_rejected_and_change_nothing_else() -> None:
    robot, talk = at_home()
    twin, other = at_home()
    for each in (talk, other):
        each.ask("LIN", *ABOVE)
        each.ask("PTA", *AWAY_DEG)
    robot.step(30)
    for wire, message_id, command in SENSELESS:
        (reply,) = talk.sends(wire)
        assert reply == Reply(message_id, command, (message_id, command, 3040, *[0] * 7), (0.0,) * 10), wire
        assert not talk.session.closing
    robot.runs_until_stopped()
    twin.runs_until_stopped()
    assert robot.joints == twin.joints
    assert len(talk.journal.refusals) == len(SENSELESS)


@pytest.mark.parametrize(
    "wire",
    [
        b"rubbish\r\n",
        b"<Cmd><I0>1</I1></Cmd>",
        b"<Cmd " + b"a" * 20_000,
        b"<Cmd I0='\xe9'/>",
    ],
    ids=lambda wire: repr(wire[:30]),
)
def test_bytes_that_are_no_xml_are_answered_without_ids_and_end_the_connection(wire: bytes) -> None:
    robot, talk = at_home()
    found = talk.sends(request(1, "FIN") + wire + request(2, "STO"))
    assert [reply.command for reply in found] == [100, 0]
    assert found[1].integers == (0, 0, 3040, *[0] * 7)
    assert talk.session.closing
    assert talk.sends(request(3, "PTA", *AWAY_DEG)) == []
    assert not robot.controller.moving
    talk.session.lost()
    assert robot.controller.errors.last is not None
    assert robot.controller.errors.last.code == 3040


@given(st.binary(max_size=120), st.integers(0, 200))
def test_no_bytes_move_the_robot_or_make_it_fail(wire: bytes, place: int) -> None:
    """Random bytes within a message that would not stop the robot."""
    robot, talk = at_home()
    message = request(1, "DIS")
    cut = place % len(message)
    talk.sends(message[:cut] + wire + message[cut:])
    assert talk.journal.faults == []
    assert not robot.controller.moving
    assert robot.controller.joints == robot.description.home
