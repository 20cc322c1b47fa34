"""KRC4 messages and what they do to the controller."""

from __future__ import annotations

from math import degrees, radians
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.krc4 import Krc4Session
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.nearest import JOINT_LIMIT, OUT_OF_REACH
from tests.journal import Journal
from tests.krc4_talking import IDS, Reply, attributes, replies, request
from tests.stepped import SteppedRobot, assert_straight, assert_within_limits

SIX_AXES = "kr_6_r900_sixx"
HOME_DEG = (0.0, -90.0, 90.0, 0.0, 90.0, 0.0)
AWAY_DEG = (20.0, -80.0, 80.0, 10.0, 60.0, -200.0)
ABOVE = (445.0, 100.0, 700.0, 180.0, 0.0, 180.0)  # X Y Z mm, A B C deg: the flange points down


class Talk:
    """A conversation without sockets."""

    def __init__(self, controller: Controller) -> None:
        self.journal = Journal(commands=True)
        self.session = Krc4Session(controller, self.journal, "a test")

    def says(self, wire: bytes) -> list[Reply]:
        """The replies to bytes."""
        self.session.receive(wire)
        return self.hears()

    def hears(self) -> list[Reply]:
        answered = b""
        while self.session.waiting:
            answered += self.session.answer()
        assert all((line + reason).isprintable() for _, line, _, reason in self.journal.refusals)
        return replies(answered)

    def ask(self, tag: str, *reals: float, **integers: int) -> Reply:
        (reply,) = self.says(request(7, tag, *reals, **integers))
        assert reply.id == 7
        assert abs(reply.command) == IDS[tag]
        return reply


def at_home(robot: str = SIX_AXES) -> tuple[SteppedRobot, Talk]:
    stepped = SteppedRobot(robot)
    return stepped, Talk(stepped.controller)


def deg(joints: tuple[float, ...]) -> list[float]:
    return [degrees(value) for value in joints]


@pytest.mark.requirement("FRC004", "FRC010")
def test_pta_comes_to_joint_positions_in_degrees() -> None:
    robot, talk = at_home()
    reply = talk.ask("PTA", *AWAY_DEG)
    assert reply == Reply(7, 25, (7, 25, *[0] * 8), (0.0,) * 10)
    robot.runs_until_stopped()
    assert deg(robot.controller.joints) == pytest.approx(AWAY_DEG)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC005", "FRC008", "FRC009")
@pytest.mark.parametrize("tag", ["PTP", "LIN"])
def test_ptp_and_lin_come_to_a_frame_in_mm_and_degrees(tag: str) -> None:
    robot, talk = at_home()
    assert talk.ask(tag, *ABOVE).error is None
    robot.runs_until_stopped()
    x_mm, y_mm, z_mm, *angles = ABOVE
    target = Frame(x_mm, y_mm, z_mm, *map(radians, angles))
    if tag == "LIN":
        assert_straight(robot, robot.joints, target)
    assert robot.controller.tool_frame()[:3] == pytest.approx(ABOVE[:3])
    reached = robot.tcp(robot.controller.joints).rotation
    assert reached == pytest.approx(target.to_transform().rotation, abs=1e-9)


@pytest.mark.requirement("FRC011")
def test_lia_is_a_straight_line_that_ends_in_joint_positions() -> None:
    robot, talk = at_home()
    target_deg = (10.0, -85.0, 85.0, 5.0, 80.0, 15.0)
    assert talk.ask("LIA", *target_deg).error is None
    robot.runs_until_stopped()
    assert deg(robot.controller.joints) == pytest.approx(target_deg)
    assert_straight(robot, robot.joints, robot.tcp_frame([radians(value) for value in target_deg]))


def test_moves_queue_run_at_full_speed_and_stop_at_each_target() -> None:
    robot, talk = at_home()
    targets = [AWAY_DEG, HOME_DEG, (0.0, -90.0, 90.0, 0.0, 60.0, 0.0)]
    for target in targets:
        assert talk.ask("PTA", *target).error is None
    robot.runs_until_stopped()
    q = np.degrees(robot.joints)
    speeds = np.abs(np.diff(q, axis=0)).max(axis=1) / robot.tick_s
    for target in targets[:-1]:
        assert speeds[int(np.abs(q - target).max(axis=1).argmin())] < 0.5
    share = np.abs(np.diff(robot.joints, axis=0)) / robot.tick_s / robot.description.velocity
    assert 0.5 < share.max() <= 1.0 + 1e-9


@pytest.mark.requirement("FRC003", "FRC013", "FRC016")
def test_sto_stops_on_the_path_and_forgets_what_waits() -> None:
    robot, talk = at_home()
    talk.ask("LIN", *ABOVE)
    talk.ask("PTA", *AWAY_DEG)
    robot.step(60)
    assert talk.ask("FIN").integers[2] == 0
    assert talk.ask("STO") == Reply(7, 1, (7, 1, *[0] * 8), (0.0,) * 10)
    assert robot.runs_until_stopped() * robot.tick_s <= 0.1
    assert talk.ask("FIN").integers[2] == 1
    assert talk.ask("DIS").reals[0] == 0.0


@pytest.mark.requirement("FRA007", "FRC019")
def test_the_goal_is_that_of_the_move_under_way() -> None:
    robot, talk = at_home()
    talk.ask("LIN", *ABOVE)
    talk.ask("PTA", *AWAY_DEG)
    robot.step(40)
    goal = talk.ask("GOP").reals
    assert goal[:3] == pytest.approx(ABOVE[:3])
    wanted = Frame(*ABOVE[:3], *map(radians, ABOVE[3:])).to_transform().rotation
    told = Frame(*goal[:3], *map(radians, goal[3:6])).to_transform().rotation
    assert told == pytest.approx(wanted, abs=1e-8)
    assert goal[6:] == (0.0,) * 4
    way_mm = np.subtract(robot.controller.tool_frame()[:3], ABOVE[:3])
    assert talk.ask("DIS").reals == pytest.approx((np.linalg.norm(way_mm), *[0.0] * 9))
    assert talk.ask("GOA").reals[:6] == pytest.approx(deg(robot.controller.goal_joints))
    robot.runs_until_stopped()
    assert talk.ask("GOA").reals == pytest.approx((*AWAY_DEG, *[0.0] * 4), abs=1e-9)


@given(st.sampled_from(["lbr_iiwa_7_r800", SIX_AXES]), st.integers(0, 10_000))
def test_what_goa_tells_pta_takes(robot: str, seed: int) -> None:
    description = load_robot(robot)
    controller = Controller(description, 0.002)
    rng = np.random.default_rng(seed)
    joints = np.degrees(rng.uniform(description.position_min, description.position_max)).tolist()
    joints[0] = round(degrees(description.position_max[0]), 9)
    talk = Talk(controller)
    assert talk.ask("PTA", *joints).error is None
    while controller.moving:
        controller.step()
    told = talk.ask("GOA").reals[: len(joints)]
    assert told == pytest.approx(joints, abs=1e-8)
    assert talk.ask("PTA", *told).error is None


@pytest.mark.requirement("FRC022", "FRC023")
def test_io_outputs_come_first_and_inputs_behind_them() -> None:
    robot, talk = at_home()
    io = robot.controller.io
    assert talk.ask("SIO", I2=3, I3=1).error is None
    assert io.output(3)
    assert talk.ask("GIO", I2=3).integers[2:] == (0, 1, *[0] * 6)
    assert talk.ask("GIO", I2=4).integers[3] == 0
    io.wire(2, on=True)
    assert talk.ask("GIO", I2=18).integers[3] == 1
    assert talk.ask("SIO", I2=3, I3=0).error is None
    assert not any(io.outputs)


@pytest.mark.parametrize(
    ("tag", "integers", "error"),
    [
        ("SIO", {"I2": 17, "I3": 1}, 2),
        ("SIO", {"I2": 33, "I3": 1}, 1),
        ("SIO", {"I2": 0, "I3": 1}, 1),
        ("SIO", {"I2": 1, "I3": 2}, 3040),
        ("GIO", {"I2": 33}, 1),
        ("GIO", {"I2": -1}, 1),
        ("GIO", {}, 1),
    ],
)
def test_io_that_there_is_not_is_refused(tag: str, integers: dict[str, int], error: int) -> None:
    robot, talk = at_home()
    reply = talk.ask(tag, **integers)
    assert reply.error == error
    assert not any(robot.controller.io.outputs)


@pytest.mark.requirement("FRC021")
@pytest.mark.parametrize(
    ("tag", "reals", "error"),
    [
        ("PTA", (171.0, *HOME_DEG[1:]), JOINT_LIMIT),
        ("LIA", (171.0, *HOME_DEG[1:]), JOINT_LIMIT),
        ("PTP", (2000.0, 0.0, 0.0, 0.0, 0.0, 0.0), OUT_OF_REACH),
        ("LIN", (2000.0, 0.0, 0.0, 0.0, 0.0, 0.0), OUT_OF_REACH),
    ],
)
def test_a_refusal_has_minus_the_id_and_the_number_of_the_error(
    tag: str, reals: tuple[float, ...], error: int
) -> None:
    robot, talk = at_home()
    reply = talk.ask(tag, *reals)
    assert reply == Reply(7, -IDS[tag], (7, -IDS[tag], error, *[0] * 7), (0.0,) * 10)
    assert not robot.controller.moving
    assert robot.controller.last_error is not None
    assert robot.controller.last_error.code == error == talk.journal.refusals[0][2]


def test_attributes_and_elements_mean_the_same_and_what_is_absent_is_0() -> None:
    _, talk = at_home()
    assert talk.says(attributes("Cmd", {"I0": 5, "I1": 100})) == talk.says(
        b"<Cmd><I0> 5 </I0><I1>\n100</I1></Cmd>"
    )
    assert talk.says(b"<Cmd I1='100'/>")[0].id == 0
    (reply,) = talk.says(b"<Cmd I0='-12' I1='25'/>")  # all joints at zero
    assert (reply.id, reply.command) == (-12, 25)


@pytest.mark.parametrize("message_id", [-(2**31), 2**31 - 1])
def test_an_id_is_any_integer_of_32_bit(message_id: int) -> None:
    _, talk = at_home()
    assert talk.says(request(message_id, "FIN"))[0].integers[:3] == (message_id, 100, 1)


SENSELESS: list[tuple[bytes, int, int]] = [
    # the message, and the ids in its reply
    (b"<Cmd/>", 0, 0),
    (b"<Cmd I0='4'/>", 4, 0),
    (b"<Cmd I0='4' I1='77'/>", 4, -77),
    (b"<Cmd I0='4' I1='-20'/>", 4, -20),
    (b"<Cmd I0='4' I1='20' R0='a'/>", 4, -20),
    (b"<Cmd I0='4' I1='20' R0='nan'/>", 4, -20),
    (b"<Cmd I0='4' I1='20' R10='1'/>", 4, -20),
    (b"<Cmd I0='4.0' I1='1'/>", 0, -1),
    (b"<Cmd I0='2147483648' I1='1'/>", 0, -1),
    (b"<Cmd I0='" + b"9" * 5000 + b"' I1='1'/>", 0, -1),
    ("<Cmd I0='\u0663' I1='1'/>".encode(), 0, -1),
    (b"<cmd I0='4' I1='1'/>", 4, -1),
    (b"<Res I0='4' I1='1'/>", 4, -1),
    (b"<Cmd I0='4' I1='1'>STO</Cmd>", 4, -1),
    (b"<Cmd><I0>4</I0><I1>1</I1><I1>1</I1></Cmd>", 4, -1),
    (b"<Cmd><I0>4</I0><I1>1</I1><I2><R0>1</R0></I2></Cmd>", 4, -1),
]


def test_what_makes_no_sense_is_refused_and_changes_nothing_else() -> None:
    robot, talk = at_home()
    twin, other = at_home()
    for each in (talk, other):
        each.ask("LIN", *ABOVE)
        each.ask("PTA", *AWAY_DEG)
    robot.step(30)
    for wire, message_id, command in SENSELESS:
        (reply,) = talk.says(wire)
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
        b"<!DOCTYPE a [<!ENTITY b 'c'>]><Cmd><I0>&b;</I0></Cmd>",
        b"<a>" * 100,
        b"<Cmd " + b"a" * 20_000,
        "<Cmd I0='1' I1='1'/>".encode("utf-16"),
        b"<Cmd I0='\xe9'/>",
    ],
    ids=lambda wire: repr(wire[:30]),
)
def test_what_is_no_xml_is_answered_without_ids_and_ends_the_connection(wire: bytes) -> None:
    robot, talk = at_home()
    found = talk.says(request(1, "FIN") + wire + request(2, "STO"))
    assert [reply.command for reply in found] == [100, 0]
    assert found[1].integers == (0, 0, 3040, *[0] * 7)
    assert talk.session.closing
    assert talk.says(request(3, "PTA", *AWAY_DEG)) == []
    assert not robot.controller.moving
    talk.session.lost()
    assert robot.controller.last_error is not None
    assert robot.controller.last_error.code == 3040


@given(st.binary(max_size=120), st.integers(0, 200))
def test_no_bytes_move_the_robot_or_make_it_fail(wire: bytes, place: int) -> None:
    """Rubbish in the midst of a message that would stop nothing, whatever it does to that."""
    robot, talk = at_home()
    message = request(1, "DIS")
    cut = place % len(message)
    talk.says(message[:cut] + wire + message[cut:])
    assert talk.journal.faults == []
    assert not robot.controller.moving
    assert robot.controller.joints == robot.description.home


@given(st.data())
def test_replies_are_the_same_however_the_requests_are_cut(data: st.DataObject) -> None:
    wire = b"".join(
        request(number, tag, **({"I2": 1} if tag in ("SIO", "GIO") else {}))
        for number, tag in enumerate(data.draw(st.lists(st.sampled_from(list(IDS)), min_size=1, max_size=6)))
    )
    cuts = sorted(data.draw(st.lists(st.integers(0, len(wire)), max_size=12)))
    whole, parted = at_home()[1], at_home()[1]
    expected = whole.says(wire)
    found: list[Reply] = []
    for start, end in zip([0, *cuts], [*cuts, len(wire)], strict=True):
        found += parted.says(wire[start:end])
    assert found == expected
    assert [reply.id for reply in found] == list(range(len(found)))


def test_replies_come_in_order_a_move_at_a_time() -> None:
    _, talk = at_home()
    talk.session.receive(b"".join(request(number, "PTA", *AWAY_DEG) for number in range(5)))
    slices = 0
    while talk.session.waiting:
        assert talk.session.answer().count(b"<Res>") == 1
        slices += 1
    assert slices == 5


@pytest.mark.requirement("FRC016")
def test_a_client_that_vanishes_with_its_move_to_be_done_stops_the_robot() -> None:
    robot, talk = at_home()
    talk.ask("PTA", *AWAY_DEG)
    robot.step(50)
    Talk(robot.controller).session.lost()  # another one, who has moved nothing
    assert talk.journal.stops == []
    talk.session.lost()
    assert talk.session.closing
    assert talk.journal.stops == [("a test", True)]
    robot.runs_until_stopped(0.2)
    assert deg(robot.controller.joints) != pytest.approx(AWAY_DEG)


@pytest.mark.requirement("FRC016")
def test_a_client_whose_moves_have_ended_stops_nobody_elses() -> None:
    robot, talk = at_home()
    talk.ask("PTA", *AWAY_DEG)
    robot.runs_until_stopped()
    other = Talk(robot.controller)
    other.ask("PTA", *[0.5 * each for each in AWAY_DEG])
    robot.step(50)
    talk.session.lost()
    assert talk.journal.stops == []
    robot.runs_until_stopped()
    assert deg(robot.controller.joints) == pytest.approx([0.5 * each for each in AWAY_DEG])


@pytest.mark.parametrize("tag", IDS)
def test_an_iiwa_speaks_it_too_with_seven_axes(tag: str) -> None:
    robot, talk = at_home("lbr_iiwa_7_r800")
    home = deg(robot.description.home)
    arguments: dict[str, Any] = {"I2": 1} if tag in ("SIO", "GIO") else {}
    reals = (450.0, 100.0, 500.0, 0.0, -90.0, 0.0) if tag in ("LIN", "PTP") else home
    assert talk.ask(tag, *reals, **arguments).error is None
    robot.runs_until_stopped()
    assert talk.ask("GOA").reals[:7] == pytest.approx(deg(robot.controller.joints), abs=1e-9)
