"""Every command gets one result, in order, whatever the robot does."""

from __future__ import annotations

from typing import Any

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.controller.errors import EXECUTION, STOP_TRIGGERED, SUCCESS
from iiwa_sim.ros.rmi.command_queue import CommandQueue, Result
from iiwa_sim.ros.rmi.definitions import message, type_of
from iiwa_sim.ros.rmi.robot import Ended, Kind, Move
from tests.journal import Journal
from tests.ros_robot import command, ptp
from tests.samples import some

COMMAND = type_of(message("robot_movement_interface/Command"))
FRAME = [0.4, 0.1, 0.5, 0.0, 3.0, 0.0]
FORCES = {"effort_type": "N", "effort": [5.0, 5.0, 5.0]}


class ScriptedRobot:
    """Moves end when the test says so; a stop ends all of them."""

    joint_names = ("A1", "A2", "A3", "A4", "A5", "A6", "A7")

    def __init__(self) -> None:
        self.ready = True
        self.running: list[tuple[Move, Ended]] = []
        self.stops = 0
        self.refuses = False

    def move(self, move: Move, ended: Ended) -> None:
        assert self.ready
        if self.refuses:
            ended(EXECUTION, "not today")
            return
        if move.kind.is_servo:
            assert all(other.kind is move.kind for other, _ in self.running), "it would end what runs"
            self.ends_all(STOP_TRIGGERED, "replaced")
        self.running.append((move, ended))

    def stop(self) -> None:
        self.stops += 1
        self.ends_all(STOP_TRIGGERED, "stopped")

    def ends_next(self, code: int = SUCCESS, reason: str = "") -> None:
        self.running.pop(0)[1](code, reason)

    def ends_all(self, code: int, reason: str) -> None:
        while self.running:
            self.ends_next(code, reason)


class Bench:
    def __init__(self) -> None:
        self.robot = ScriptedRobot()
        self.published: list[Result] = []
        self.queue = CommandQueue(self.robot, self.published.append, Journal(fails=True))

    def take(self, *commands: dict[str, Any], replace: bool = False) -> None:
        self.queue.take([msgspec.convert(each, COMMAND) for each in commands], replace=replace)

    def steps(self, count: int = 10) -> None:
        for _ in range(count):
            self.queue.step()

    @property
    def codes(self) -> list[tuple[int, int]]:
        return [(result.command_id, result.code) for result in self.published]


def joints(identifier: int) -> dict[str, Any]:
    return ptp(identifier, [0.0] * 7)


def smart(identifier: int) -> dict[str, Any]:
    return command(identifier, "SMART", "JOINTS", [0.0] * 7)


def force(identifier: int) -> dict[str, Any]:
    return command(identifier, "LINFORCE", "EULER_INTRINSIC_ZYX", FRAME, **FORCES)


def bad(identifier: int) -> dict[str, Any]:
    return command(identifier, "CIRC", "EULER_INTRINSIC_ZYX", FRAME)


def test_plain_moves_are_sent_ahead_one_per_tick() -> None:
    bench = Bench()
    bench.take(joints(1), joints(2), joints(3))
    bench.steps(2)
    assert len(bench.robot.running) == 2
    bench.steps()
    assert len(bench.robot.running) == 3
    bench.robot.ends_next()
    bench.steps()
    assert bench.codes == [(1, SUCCESS)]


def test_servo_and_force_moves_wait_for_those_before_and_keep_those_behind_waiting() -> None:
    for special in (smart, force):
        bench = Bench()
        bench.take(joints(1), special(2), special(3), joints(4))
        for done in range(4):
            bench.steps()
            assert len(bench.robot.running) == 1
            bench.robot.ends_next()
            bench.steps(1)
            assert bench.codes == [(k + 1, SUCCESS) for k in range(done + 1)]


def test_a_list_that_replaces_stops_the_robot_and_ends_what_waits() -> None:
    bench = Bench()
    bench.take(joints(1), force(2), joints(3))
    bench.steps()
    bench.take(joints(4), replace=True)
    assert bench.codes == [(k, STOP_TRIGGERED) for k in (1, 2, 3)]
    assert bench.robot.stops == 1
    assert all("replaced by a newer list" in result.information for result in bench.published)
    bench.steps()
    bench.robot.ends_next()
    bench.steps()
    assert bench.codes[3:] == [(4, SUCCESS)]


def test_a_servo_takes_a_new_target_without_a_stop() -> None:
    bench = Bench()
    bench.take(smart(1))
    bench.steps()
    bench.take(smart(2), replace=True)
    bench.steps()
    assert bench.robot.stops == 0
    assert bench.codes == [(1, STOP_TRIGGERED)]
    assert [move.kind for move, _ in bench.robot.running] == [Kind.SMART]
    bench.take(joints(3), replace=True)
    assert bench.robot.stops == 1


def test_a_servo_whose_next_target_is_refused_stops() -> None:
    bench = Bench()
    bench.take(smart(1))
    bench.steps()
    bench.take({**smart(2), "velocity": []}, replace=True)
    bench.steps()
    assert bench.robot.stops == 1
    assert bench.codes == [(1, STOP_TRIGGERED), (2, EXECUTION)]


def test_after_a_refused_command_those_before_it_run_and_those_behind_do_not() -> None:
    bench = Bench()
    bench.take(joints(1), joints(2), bad(3), joints(4), smart(5))
    bench.steps()
    assert len(bench.robot.running) == 2
    assert bench.robot.stops == 0
    assert bench.codes == []
    bench.robot.ends_next()
    bench.robot.ends_next()
    bench.steps()
    assert bench.codes == [(1, SUCCESS), (2, SUCCESS), (3, EXECUTION), (4, EXECUTION), (5, EXECUTION)]
    assert "command_type 'CIRC'" in bench.published[2].information
    assert bench.published[3].information.startswith("not carried out, after command 3: command_type 'CIRC'")


makers = st.sampled_from([joints, smart, force, bad])
events = st.one_of(
    st.tuples(st.just("take"), st.lists(makers, max_size=4), st.booleans()),
    st.tuples(st.just("step"), st.integers(1, 4), st.none()),
    st.tuples(st.just("end"), st.sampled_from([SUCCESS, SUCCESS, STOP_TRIGGERED, EXECUTION]), st.none()),
    st.tuples(st.just("refuse"), st.booleans(), st.none()),
    st.tuples(st.just("cancel"), st.none(), st.none()),
)


@settings(max_examples=some(200))
@given(st.lists(events, max_size=30))
def test_every_command_gets_one_result_in_order(program: list[tuple[str, Any, Any]]) -> None:
    bench, taken = Bench(), 0
    for event, what, replace in program:
        if event == "take":
            bench.take(*[make(taken + k) for k, make in enumerate(what)], replace=replace)
            taken += len(what)
        elif event == "step":
            bench.steps(what)
        elif event == "end" and bench.robot.running:
            bench.robot.ends_next(what, "as the test wants")
        elif event == "refuse":
            bench.robot.refuses = what
        elif event == "cancel":
            bench.queue.cancel("cancelled by the test")
            assert not bench.robot.running
            assert len(bench.published) == taken
    bench.robot.refuses = False
    for _ in range(taken):
        bench.steps(2)
        if bench.robot.running:
            bench.robot.ends_next()
    bench.steps(2)
    assert [result.command_id for result in bench.published] == list(range(taken))
