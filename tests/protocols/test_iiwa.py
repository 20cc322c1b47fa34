import pytest

from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.table import load_table
from iiwa_sim.robot.description import load_robot
from tests.protocols.fake_robot import Conversation, FakeRobot
from tests.requests import (
    direct_cartesian_move,
    direct_joint_move,
    gravity_hold,
    joint_move,
    lin_joint_move,
    lin_move,
    lin_stiff_move,
    ptp_move,
    ptp_stiff_move,
    smart_cartesian_move,
    smart_joint_move,
)

TABLE = load_table("iiwa")
LIN = "lin move : 600 0 500 3 0 3 0.5 0"


@pytest.mark.requirement("FRA006", "FRC001")
def test_moves_reach_the_controller_with_their_values():
    robot = FakeRobot()
    talk = Conversation(robot)
    frame = Frame(600.0, -0.5, 500.0, 3.0, 0.25, -3.0)
    assert talk.ask("lin move : 600 -.5 5e2 3. 0.25 -3 0.5 10") == "done"
    assert talk.ask("ptp move : 600 -.5 5e2 3. 0.25 -3 0.5 10") == "done"
    assert talk.ask("linr move : 600 -.5 5e2 3. 0.25 -3 0.5 10 1.25") == "done"
    assert talk.ask("ptpr move : 600 -.5 5e2 3. 0.25 -3 0.5 10 1.25") == "done"
    assert talk.ask("joint move : 0 1 2 3 4 5 6 .1 .2 .3 .4 .5 .6 .7") == "done"
    assert talk.ask("lin joint move : 0 1 2 3 4 5 6 .1 20") == "done"
    assert talk.ask("linstiff move : 600 -.5 5e2 3. 0.25 -3 0.5 2000 1 2 3 .4 .5 .6") == "done"
    assert talk.ask("ptpstiff move : 600 -.5 5e2 3. 0.25 -3 0.5 0 1 2 3 .4 .5 .6") == "done"
    assert talk.ask("start gravity : 300") == "done"
    assert talk.ask("smart joint move : 0 1 2 3 4 5 6 .1 .2 .3 .4 .5 .6 .7") == "done"
    assert talk.ask("direct joint move : 0 1 2 3 4 5 6 .1 .2 .3 .4 .5 .6 .7") == "done"
    assert talk.ask("smart cartesian move : 600 -.5 5e2 3. 0.25 -3 0.5") == "done"
    assert talk.ask("direct cartesian move : 600 -.5 5e2 3. 0.25 -3 0.5") == "done"
    assert robot.moves == [
        lin_move(frame, 0.5, 10.0),
        ptp_move(frame, 0.5, 10.0),
        lin_move(frame, 0.5, 10.0, 1.25),
        ptp_move(frame, 0.5, 10.0, 1.25),
        joint_move((0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7), 0.1),
        lin_joint_move((0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0), 0.1, 20.0),
        lin_stiff_move(frame, 0.5, 2000.0, (1.0, 2.0, 3.0, 0.4, 0.5, 0.6)),
        ptp_stiff_move(frame, 0.5, 0.0, (1.0, 2.0, 3.0, 0.4, 0.5, 0.6)),
        gravity_hold(300.0),
        smart_joint_move((0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)),
        direct_joint_move((0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)),
        smart_cartesian_move(frame, 0.5),
        direct_cartesian_move(frame, 0.5),
    ]
    assert robot.stops == 0
    assert talk.ask("stop") == "done"
    assert robot.stops == 1


def test_a_fault_of_the_controller_is_an_error_and_the_session_continues():
    robot = FakeRobot()
    robot.breaks = ZeroDivisionError("ours")
    talk = Conversation(robot)
    assert talk.ask(LIN) == "error"
    assert talk.journal.faults == [("client", LIN, robot.breaks)]
    assert robot.breaks.__traceback__ is not None
    robot.breaks = None
    assert talk.ask(LIN) == "done"


@pytest.mark.parametrize("line", ["help lin move", "? lin move", "Help? lin move", "help? : lin move"])
def test_help_is_understood_without_a_colon(line):
    talk = Conversation()
    assert talk.ask(line) == talk.ask("help : lin move")
    assert talk.ask("?") == talk.ask("help?") == talk.ask("help")
    assert talk.ask("helping") == "unknown command"


def test_telnets_question_after_ctrl_c_is_answered():
    talk = Conversation()
    talk.session.receive(b"\xff\xf4\xff\xfd\x06")
    assert talk.receive() == b"\xff\xfc\x06"
    talk.session.receive(b"hello\r\n")
    assert talk.receive() == b"hello\r\n"


def test_utf_16_is_rejected():
    talk = Conversation()
    talk.session.receive("hello\n".encode("utf-16-le"))
    assert talk.receive().startswith(b"unknown command\r\n")


@pytest.mark.requirement("FRA005")
def test_help_names_every_command_and_its_usage():
    talk = Conversation()
    overview = talk.ask("help")
    for name, command in TABLE.commands.items():
        assert name in overview
        usage = talk.ask(f"help : {name}")
        assert usage.startswith(command.usage())
        assert command.summary in usage
        assert ("(extension)" in usage) == command.extension


MOVES = {
    "normal": "joint move : 1 1 1 -1.5 1 1 1" + " 0.5" * 7,
    "smart": "smart joint move : 1 1 1 -1.5 1 1 1" + " 0.5" * 7,
    "direct": "direct joint move : 0.05 0.5 0.05 -1 0.05 1.5 0.05" + " 0.1" * 7,
}


def malformed(name: str, count: int) -> list[str]:
    """Return malformed lines of a command that moves."""
    fits = ["0.5"] * count
    more = [*fits, *["0.5"] * len(TABLE.commands[name].optional), "0.5"]
    wrong = [fits[:-1], more, ["nan", *fits[1:]], ["0,5", *fits[1:]]]
    for k, each in enumerate(TABLE.commands[name].parameters):
        if each.range:
            wrong.append([*fits[:k], "-1e9", *fits[k + 1 :]])
    return [f"{name} : {' '.join(words)}" for words in wrong] + [name, f"{name} : : {' '.join(fits)}"]


@pytest.mark.requirement("FRA104")
@pytest.mark.parametrize("mode", MOVES)
def test_malformed_lines_in_mid_motion_change_nothing(mode):
    lines = [
        line
        for name, command in TABLE.commands.items()
        if command.parameters
        for line in malformed(name, len(command.parameters))
    ]
    bothered, left_alone = (Controller(load_robot(), 0.002) for _ in range(2))
    talk = Conversation(bothered, strict=True)  # else one with a value more is a move
    for robot in (bothered, left_alone):
        assert Conversation(robot).ask(MOVES[mode]) == "done"
        for _ in range(20):
            robot.step()
    for line in [*lines, "", "stopp", "stop now", "smart joint move", "get mode : :", "\u00fc"]:
        assert talk.ask(line) in ("error", "unknown command")
        assert talk.ask("get mode") == mode
        for robot in (bothered, left_alone):
            robot.step()
        assert bothered.joints == left_alone.joints
        assert bothered.moving == left_alone.moving
