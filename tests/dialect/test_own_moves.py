"""Which moves of a client are still to be done, in no more room than these take."""

import gc
import tracemalloc

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialect.own_moves import OwnMoves
from iiwa_sim.robot.description import load_robot
from tests.dialect.fake_robot import Conversation


@given(st.lists(st.tuples(st.booleans(), st.sets(st.integers(0, 300)))))
def test_any_pending_is_told_whatever_becomes_of_the_others(rounds):
    """Each round adds a move, or only ends those that are named."""
    pending: set[int] = set()
    own = OwnMoves(pending.__contains__)
    for number, (moves, ended) in enumerate(rounds):
        pending -= ended
        if moves:
            pending.add(number)
            own.add(number)
        assert own.any_pending() == bool(pending)
    own.clear()
    assert not own.any_pending()


def test_moves_that_are_over_are_sought_out_where_the_first_one_is_not():
    pending = {0}
    asked = []

    def is_pending(number):
        asked.append(number)
        return number in pending

    own = OwnMoves(is_pending)
    for number in range(10_000):
        own.add(number)
    asked.clear()
    pending.clear()
    assert not own.any_pending()
    assert len(asked) < 200


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
        assert min(room_bytes(talk, 300) for _ in range(3)) < 20_000
    finally:
        tracemalloc.stop()
    assert controller.queue == 0
    assert controller.moving
