"""The backdoor's lines: each is its method, and what is wrong changes nothing."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.surfaces import BoxSettings, CylinderSettings, PlaneSettings, SphereSettings
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.faults import (
    EVERY,
    NEXT,
    CloseAfter,
    CloseBefore,
    Delay,
    Drop,
    Garble,
    Pass,
    ResetBefore,
    Split,
)
from iiwa_sim.protocols.table import load_table
from tests.asked import joint_move, smart_joint_move
from tests.backdoor.bench import IIWA, KR_6, Bench
from tests.samples import some

TABLE = load_table("backdoor", 7)
MATERIAL = {"stiffness_n_per_m": 5e4, "damping_s_per_m": 1.0, "friction": 0.3}
POSE = {"x_mm": 600.0, "y_mm": 300.0, "z_mm": 50.0, "alpha": 0.1, "beta": 0.2, "gamma": 0.3}
PLACES = {IIWA: (0.1, 0.2, 0.3, -1.0, 0.5, 1.0, 0.7), KR_6: (0.1, -1.5, 1.4, 0.5, 1.0, 0.7)}
PLACE = PLACES[IIWA]

PAIRS: dict[str, Callable[[Backdoor], object]] = {
    "pause": Backdoor.pause,
    "set clock : FAST": lambda b: b.set_clock("fast"),
    "push : 1 2 3 4 5 6": lambda b: b.push((1, 2, 3, 4, 5, 6)),
    "push : 0 0 0 0 0 0": lambda b: b.push((0, 0, 0, 0, 0, 0)),
    "release": Backdoor.release,
    "add plane : the floor 600 300 50 0.1 0.2 0.3 5e4 1 0.3": lambda b: b.add_surface(
        PlaneSettings(name="the floor", **POSE, **MATERIAL)
    ),
    "add box : box 600 300 50 0.1 0.2 0.3 10 20 30 5e4 1 0.3": lambda b: b.add_surface(
        BoxSettings(name="box", size_mm=(10, 20, 30), **POSE, **MATERIAL)
    ),
    "add sphere : Ball 600 300 50 0.1 0.2 0.3 40 5e4 1 0.3": lambda b: b.add_surface(
        SphereSettings(name="Ball", radius_mm=40, **POSE, **MATERIAL)
    ),
    "add cylinder : 1 600 300 50 0.1 0.2 0.3 40 60 5e4 1 0.3": lambda b: b.add_surface(
        CylinderSettings(name="1", radius_mm=40, length_mm=60, **POSE, **MATERIAL)
    ),
    "move surface : table 1 2 -30 0 0 0.5": lambda b: b.move_surface("table", Frame(1, 2, -30, 0, 0, 0.5)),
    "remove surface : table": lambda b: b.remove_surface("table"),
    "set tool : 1 2 100 0 0.5 0": lambda b: b.set_tool(Frame(1, 2, 100, 0, 0.5, 0)),
    "set input : 3 1": lambda b: b.set_input(3, on=True),
    "emergency stop": Backdoor.emergency_stop,
    "release emergency stop": Backdoor.release_emergency_stop,
    "protective stop": Backdoor.protective_stop,
    "drives off": lambda b: b.switch_drives(on=False),
    "drives on": lambda b: b.switch_drives(on=True),
    "reset error": Backdoor.reset_error,
    "set override : 0.25": lambda b: b.set_override(0.25),
    "save state : Here  and now": lambda b: b.save_state("Here and now"),
    "restore state : start": lambda b: b.restore_state("start"),
    "seed : 7": lambda b: b.seed(7),
    "refuse next move : 3021": lambda b: b.refuse_next_move(3021),
    "following error : 3": lambda b: b.following_error(3),
    "remove part : disc": lambda b: b.remove_part("disc"),
    "stick jaws : 1": lambda b: b.stick_jaws(stuck=True),
    "wrong sensor : holds 1": lambda b: b.wrong_sensor("holds", on=True),
    "reply : get status = moving 2": lambda b: b.reply("get status", "moving", 2),
    "reply : Lin  Move = x = 1 0 0": lambda b: b.reply("lin move", "x = 1 0", 0),
    "pass replies : 0 3": lambda b: b.set_fault(Pass(), EVERY, 3),
    "delay replies : -1 2 0.5": lambda b: b.set_fault(Delay(0.5), NEXT, 2),
    "split replies : 0 0 3 0.1": lambda b: b.set_fault(Split(3, 0.1)),
    "drop replies : 0 1": lambda b: b.set_fault(Drop(), replies=1),
    "garble replies : 0 0": lambda b: b.set_fault(Garble()),
    "close before replies : 0 1": lambda b: b.set_fault(CloseBefore(), replies=1),
    "close after replies : 0 1": lambda b: b.set_fault(CloseAfter(), replies=1),
    "reset at replies : 0 1": lambda b: b.set_fault(ResetBefore(), replies=1),
    "stop answering : 0": Backdoor.stop_answering,
    "close connections : 0": Backdoor.close_connections,
    "reset connections : 0": Backdoor.reset_connections,
    "refuse connections": Backdoor.refuse_connections,
    "clear faults": Backdoor.clear_faults,
}
NOTHING_TO_UNDO = {
    "push : 0 0 0 0 0 0",
    "release",
    "release emergency stop",
    "drives on",
    "close connections : 0",
    "reset connections : 0",
    "clear faults",
}
PREPARED = {
    # It would be round the disc, which lies on the table.
    "add plane : the floor 600 300 50 0.1 0.2 0.3 5e4 1 0.3": "remove part : disc",
    "resume": "pause",
    "reset error": "protective stop",
    "servo timeout": "smart",
    "fail move : 3000": "normal",
    "accept connections": "refuse connections",
    "repair gripper": "stick jaws : 1",
    "lose part": "held",
}
PAIRS_WITH_MORE: dict[str, Callable[[Backdoor], object]] = {
    "resume": Backdoor.resume,
    "servo timeout": Backdoor.time_out_servo,
    "fail move : 3000": lambda b: b.fail_move(3000),
    "accept connections": Backdoor.accept_connections,
    "repair gripper": Backdoor.repair_gripper,
    "lose part": Backdoor.lose_part,
}


def pairs(robot: str) -> dict[str, Callable[[Backdoor], object]]:
    """All of them, with those that have a number for each joint."""
    place = PLACES[robot]
    torques = tuple(range(1, len(place) + 1))
    return (
        PAIRS
        | PAIRS_WITH_MORE
        | {
            f"place : {' '.join(map(str, place))}": lambda b: b.place(place),
            f"push joints : {' '.join(map(str, torques))}": lambda b: b.push_joints(torques),
        }
    )


def prepared(line: str, robot: str = IIWA) -> Bench:
    bench, place = Bench(robot), PLACES[robot]
    assert bench.tell("add plane : table 0 0 -10 0 0 0 1e5 0 0") == "done"
    before = PREPARED.get(line, "")
    if before == "smart":
        bench.controller.move(smart_joint_move(place, [0.2] * len(place)))
    elif before == "normal":
        bench.controller.move(joint_move(place, [0.2] * len(place)))
    elif before == "held":
        bench.grips_disc()
    elif before:
        assert bench.tell(before) == "done"
    bench.robot.step(5)
    return bench


@pytest.mark.parametrize(
    ("robot", "line", "method"),
    [
        (robot, line, method)
        for robot in PLACES
        for line, method in pairs(robot).items()
        if robot == IIWA or line.startswith(("place", "push joints"))
    ],
)
def test_a_line_is_its_method(robot: str, line: str, method: Callable[[Backdoor], object]) -> None:
    by_line, by_method = prepared(line, robot), prepared(line, robot)
    before = by_line.seen()
    assert by_line.tell(line) == "done"
    method(by_method.backdoor)
    assert by_line.seen() == by_method.seen()
    assert (by_line.seen() == before) == (line in NOTHING_TO_UNDO)


def test_each_line_that_changes_something_is_compared_with_its_method() -> None:
    compared = {line.partition(" :")[0] for line in pairs(IIWA)}
    changing = {name for name, command in TABLE.commands.items() if command.reply_words == ("done",)}
    assert changing - {"advance", "release when gone"} == compared


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("hello", "hello"),
        ("get clock", "stepped"),
        ("get override", "1.0"),
        ("get surfaces", '["table"]'),
        ("get states", '["start"]'),
        ("get input : 1", "0"),
        ("get output : 2", "1"),
        ("get outputs", "0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0"),
        ("get inputs", "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0"),
        ("get connections", "{}"),
        ("help : remove surface", "remove surface : [name] -> done; Removes a surface."),
        ("Help : MOVE Surface", None),
    ],
)
def test_what_is_asked_for(line: str, reply: str | None) -> None:
    bench = prepared("")
    bench.controller.io.set_output(2, on=True)
    answered = bench.tell(line)
    assert answered == reply if reply is not None else answered.startswith("move surface : [name] x[mm, ")
    assert TABLE.commands.keys() == set(bench.tell("help").partition(" (help : push")[0].split(", "))


def test_names_are_in_utf_8() -> None:
    bench = prepared("")
    assert bench.tell("add sphere : Würfel 2 600 300 50 0 0 0 40 5e4 1 0") == "done"
    assert bench.backdoor.surfaces() == ["table", "Würfel 2"]
    assert bench.tell("get surfaces") == '["table","W\\u00fcrfel 2"]'
    assert bench.tell("remove surface : Würfel 2") == "done"
    assert bench.tell(b"remove surface : W\xfcrfel 2").startswith("error 3000 no surface 'W\\\\xfcrfel 2'")


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("", "error 3040 empty line"),
        ("push", "error 3040 push takes fx fy fz tx ty tz: 6 values, got 0"),
        ("jump : 1", "error 3040 no such command; help lists them"),
        ("push : 1 2 3 4 5 nan", "error 3040 tz = nan: expected a number"),
        (
            "add box : table 0 0 -10 0 0 0 1 1 1 1e5 0 0",
            "error 3000 surface: name = 'table': expected a name",
        ),
        (
            "move surface : table 0 0 1000 0 0 0",
            "error 3000 the TCP would be 479.590 mm within surface 'table'",
        ),
        ("remove surface : Table", "error 3000 no surface 'Table': there are 'table'"),
        ("set tool : 0 0 20000 0 0 0", "error 3040 z = 20000: expected at least -10000 and up to 10000"),
        ("set input : 17 1", "error 1 no input 17: there are inputs 1 to 16"),
        ("place : 0 0 0 3 0 0 0", "error 3023 A4 at 3 rad is outside"),
        ("emergency stop : 0", "error 3040 emergency stop takes no values, got 1"),
        ("add sphere : a:b 600 300 50 0 0 0 40 5e4 1 0", "error 3040 more than one ':'"),
        ("save state : start", "error 3000 start is the state at the beginning: expected another name"),
        ("reply : get status moving 1", "error 3040 reply takes command = reply and times: 1 value"),
        ("fail move : 3000", "error 3000 nothing moves that could fail"),
        ("drop replies : 1 1", "error 3000 no connection 1: there are none"),
        ("set clock : soon", "error 3000 clock 'soon': expected real, a multiple"),
    ],
)
def test_what_is_wrong_is_answered_with_its_reason_and_changes_nothing(line: str, reply: str) -> None:
    bench = prepared("")
    before = bench.seen()
    assert bench.tell(line).startswith(reply)
    assert bench.seen() == before
    assert len(bench.journal.refusals) == 1
    assert bench.controller.last_error is None, "a driver does not learn of it"


@pytest.mark.parametrize("robot", PLACES)
def test_an_error_is_reset_when_its_cause_is_gone(robot: str) -> None:
    bench = prepared("", robot)
    for line in ("emergency stop", "drives off"):
        assert bench.tell(line) == "done"
    assert bench.tell("reset error") == "error 3030 the emergency stop has to be released first"
    assert bench.tell("release emergency stop") == "done"
    assert bench.tell("reset error") == "error 3010 the drives have to be switched on first"
    assert bench.tell("drives on") == "done"
    assert bench.backdoor.state().robot_status.in_error == 1
    assert bench.tell("reset error") == "done"
    assert bench.backdoor.state().robot_status.in_error == 0


@settings(max_examples=some(60))
@given(
    st.one_of(
        st.binary(max_size=60),
        st.text("acdehilmnoprstuvw :01.-", max_size=40).map(str.encode),
        st.tuples(st.sampled_from(sorted(TABLE.commands)), st.text("0123.- :e", max_size=20)).map(
            lambda each: f"{each[0]} :: {each[1]}".encode()
        ),
    ).filter(lambda line: not {0, 10, 13, 255}.intersection(line))
)
def test_rubbish_is_an_error_and_changes_nothing(line: bytes) -> None:
    if TABLE.find(line.partition(b":")[0]) is not None and line.count(b":") < 2:
        return  # a command after all
    bench = prepared("")
    before = bench.seen()
    assert bench.tell(line).startswith("error 3040 ")
    assert bench.seen() == before


def test_a_robot_that_moves_is_not_placed_restored_saved_or_given_a_tool() -> None:
    bench = prepared("")
    bench.controller.move(joint_move(PLACE, [0.2] * 7))
    bench.robot.step(20)
    before = bench.seen()
    for line in (
        "place : 0.1 0.2 0.3 -1 0.5 1 0.7",
        "restore state : start",
        "save state : here",
        "set tool : 0 0 100 0 0 0",
    ):
        assert bench.tell(line) == "error 3000 the robot has to be at rest, with nothing waiting"
    assert bench.seen() == before


@pytest.fixture
async def ticking() -> AsyncIterator[Bench]:
    """A bench whose clock can make ticks."""
    bench = prepared("")
    bench.clock.start(bench.controller)
    yield bench
    bench.clock.stop()


async def test_time_passes_when_it_is_told_to_and_replies_wait_for_it(ticking: Bench) -> None:
    bench = ticking
    bench.controller.move(joint_move(PLACE, [1.0] * 7))
    tick = bench.controller.tick
    bench.session.receive(b"advance : 0.1\nget clock\nrun until stopped : 20\nrun until stopped : 0\nhello\n")
    replies = []
    while bench.session.waiting:
        replies.append(bench.session.answer())
        if bench.session.pending is not None:
            assert bench.session.answer() == b"", "until that is done"
            await bench.session.pending
    said = b"".join(replies).decode().split("\r\n")
    assert said[:2] == ["done", "stepped"]
    assert said[3:] == ["0.0", "hello", ""]
    assert bench.controller.joints == PLACE
    assert float(said[2]) == pytest.approx((bench.controller.tick - tick) * 0.002 - 0.1)


async def test_who_goes_waits_for_no_time_any_more(ticking: Bench) -> None:
    bench = ticking
    bench.session.receive(b"advance : 5\n")
    assert bench.session.answer() == b""
    task = bench.session.pending
    assert task is not None
    bench.session.lost()
    await asyncio.wait([task])
    assert task.cancelled()
    assert bench.controller.tick == 5


@pytest.mark.parametrize("asked", [True, False])
def test_pushes_end_with_the_connection_that_asked_for_that(asked: bool) -> None:
    bench = Bench()
    if asked:
        assert bench.tell("release when gone") == "done"
    assert bench.tell("push : 1 0 0 0 0 0") == "done"
    assert bench.tell("push joints : 0 0 0 0 0 0 1") == "done"
    bench.session.lost()
    load = bench.controller.load
    assert (any(load.wrench), any(load.joint_push)) == (not asked, not asked)


def test_bye_ends_the_conversation_and_moves_nothing() -> None:
    bench = prepared("")
    bench.controller.move(joint_move(PLACE, [0.1] * 7))
    bench.session.receive(b"bye\nemergency stop\n")
    assert bench.session.answer() == b"bye\r\n"
    assert bench.session.closing
    assert bench.controller.moving
    assert bench.controller.status().e_stopped == 0


def test_a_fault_of_ours_costs_no_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = prepared("")

    def breaks(_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(bench.controller, "fail", breaks)
    assert bench.tell("protective stop") == "error 3000 internal error, see the log"
    assert bench.tell("hello") == "hello"
    assert len(bench.journal.faults) == 1
