"""Whose work is done when, in hand-made time: nothing here takes any."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.server.budget import MOST_AHEAD_S, PIECE_S, QUIET_TURNS, TURN_S, Budget
from tests.samples import some

TICK_S = 0.002


class World:
    """A budget whose time passes only while somebody works, and ticks that are due in it."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.elsewhere_s = 0.0  # of it, that the machine did something else
        self.ticks_late_s: list[float] = []
        self.due_s = 100.0
        self.done: list[str] = []
        self.turns = 0
        self.budget = Budget(
            self.tick, now_s=lambda: self.now_s, spent_s=lambda: self.now_s - self.elsewhere_s
        )

    def tick(self) -> None:
        while self.due_s <= self.now_s:
            self.ticks_late_s.append(self.now_s - self.due_s)
            self.due_s += TICK_S

    def client(self, name: str, cost_s: float, jobs: int) -> Client:
        return Client(self, name, cost_s, jobs)

    async def turn(self, count: int = 1) -> None:
        for _ in range(count):
            self.turns += 1
            await asyncio.sleep(0)


class Client:
    """Has so many jobs, each of the same cost."""

    def __init__(self, world: World, name: str, cost_s: float, jobs: int) -> None:
        self.name, self.cost_s, self.jobs, self._world = name, cost_s, jobs, world
        self.asks_in_work = False  # as rosbridge does, when a reply is there to be sent
        self.share = world.budget.share(self.work)

    def work(self, until_s: float) -> bool:
        while self.jobs:
            self.jobs -= 1
            self._world.now_s += self.cost_s
            self._world.done.append(self.name)
            if self.asks_in_work:
                self.share.ask_later()
            if self._world.now_s >= until_s:
                break
        return self.jobs > 0

    def asks(self, jobs: int = 1) -> None:
        self.jobs += jobs
        self.share.ask()


@pytest.mark.requirement("FRA101")
@pytest.mark.parametrize(("flooders", "cost_s"), [(10, 1.5e-3), (200, 5e-5)])
@pytest.mark.parametrize("in_work", [False, True])
async def test_who_asks_now_and_then_waits_for_a_turn_at_most_however_many_flood(
    flooders: int, cost_s: float, in_work: bool
) -> None:
    world = World()
    flood = [world.client(f"flooder {k}", cost_s, 10**9) for k in range(flooders)]
    polite = world.client("polite", 3e-5, 0)
    for each in flood:
        each.asks_in_work = in_work
        each.asks()
    await world.turn(flooders)  # until it is known who has always more to do
    for _ in range(50):
        await world.turn(QUIET_TURNS)
        asked_s = world.now_s
        polite.asks()
        while polite.jobs:
            await world.turn()
        assert world.now_s - asked_s < TURN_S + cost_s + 1e-4


@pytest.mark.parametrize("flooders", [1, 200])
async def test_ticks_come_before_each_piece_of_work(flooders: int) -> None:
    world, cost_s = World(), 7e-5
    for k in range(flooders):
        world.client(f"flooder {k}", cost_s, 10**9).asks()
    await world.turn(500)
    passed_s = world.now_s - 100.0
    assert len(world.ticks_late_s) >= int(passed_s / TICK_S)
    assert max(world.ticks_late_s) <= TURN_S + cost_s if flooders == 1 else PIECE_S + cost_s


async def test_a_turn_of_the_loop_is_short() -> None:
    world = World()
    for k in range(200):
        world.client(f"flooder {k}", 2e-5, 10**9).asks()
    for _ in range(300):
        before_s = world.now_s
        await world.turn()
        assert world.now_s - before_s <= TURN_S + PIECE_S + 2e-5


@settings(max_examples=some(30), deadline=None)
@given(st.lists(st.floats(1e-6, 0.8 * MOST_AHEAD_S), min_size=2, max_size=20))
def test_those_who_always_have_work_get_equal_parts_of_the_time(costs: list[float]) -> None:
    async def run() -> None:
        world = World()
        clients = [world.client(str(k), cost_s, 10**9) for k, cost_s in enumerate(costs)]
        for each in clients:
            each.asks()
        while world.now_s < 100.0 + 100 * len(costs) * max(*costs, PIECE_S):
            await world.turn()
        used = [world.done.count(each.name) * each.cost_s for each in clients]
        # What counts is the work and a little for each piece, which those with short ones have more of.
        assert max(used) - min(used) <= 2 * max(*costs, PIECE_S) + 0.35 * max(used)

    asyncio.run(run())


async def test_those_who_come_now_and_then_in_numbers_do_not_keep_others_from_their_work() -> None:
    world = World()
    world.client("busy", 1e-4, 10**9).asks()
    crowd = [world.client("crowd", 1e-4, 0) for _ in range(300)]
    await world.turn(10)
    for _ in range(200):
        for each in crowd:
            if not each.share.waits:
                each.share.idle_since_turn -= QUIET_TURNS
                each.asks()
        before = world.done.count("busy"), world.now_s
        await world.turn()
        worked_s = 1e-4 * (world.done.count("busy") - before[0])
        assert worked_s >= 0.3 * (world.now_s - before[1]) > 0.0, "some half of the time"


async def test_alone_it_is_done_at_once_and_asked_in_work_it_is_done_later() -> None:
    world = World()
    other = world.client("other", 0.0, 1)

    def work(_until_s: float) -> bool:
        other.share.ask()
        world.done.append("first")
        return False

    world.budget.share(work).ask()
    assert world.done == ["first"]
    await world.turn()
    assert world.done == ["first", "other"]
    other.jobs = 1
    other.share.ask_later()
    assert len(world.done) == 2
    await world.turn()
    assert len(world.done) == 3


async def test_nothing_is_done_for_who_has_left() -> None:
    world = World()
    world.client("flooder", 1e-4, 10**9).asks()
    gone = world.client("gone", 1e-4, 1)
    gone.share.ask()
    gone.share.leave()
    await world.turn(100)
    gone.share.ask()
    assert "gone" not in world.done
