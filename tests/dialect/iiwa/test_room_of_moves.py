"""Moves that have ended take no room in a session."""

import gc
import tracemalloc

from iiwa_sim.controller.controller import Controller
from iiwa_sim.robot.description import load_robot
from tests.dialect.fake_robot import Conversation


def room_bytes(talk: Conversation, rounds: int) -> int:
    """What it takes that moves come and are forgotten, while the first one runs."""
    gc.collect()
    before, _ = tracemalloc.get_traced_memory()
    for _ in range(rounds):
        assert talk.ask("ptpforcez move : 450 10 520 0 -1.57079 0 0.5 0 10") == "done"
        assert talk.ask("clear queue") == "done"
    gc.collect()
    return tracemalloc.get_traced_memory()[0] - before


def test_moves_that_come_and_are_forgotten_while_one_runs_take_no_room():
    controller = Controller(load_robot(), 0.002)
    talk = Conversation(controller)
    assert talk.ask("ptp move : 450 200 520 0 -1.57079 0 0.01 0") == "done"
    controller.step()
    tracemalloc.start()
    try:
        room_bytes(talk, 50)
        # What is kept for each move takes room each time; what the process keeps by the way, only once.
        assert min(room_bytes(talk, 150) for _ in range(3)) < 20_000
    finally:
        tracemalloc.stop()
    assert controller.queue == 0
    assert controller.moving
