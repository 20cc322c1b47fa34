"""Actions of one connection, with delays between them: carried out in order, or dropped."""

from __future__ import annotations

import asyncio
from functools import partial

from iiwa_sim.server.in_order import InOrder
from tests.talking import until


async def test_what_comes_behind_a_delay_waits_for_it_and_the_rest_is_done_at_once() -> None:
    done = list[str]()
    order = InOrder(partial(done.append, "idle"))
    order.do(partial(done.append, "at once"))
    order.wait(0.0)
    for name in ("first", "second"):
        order.do(partial(done.append, name))
        order.wait(0.0)
    assert (done, order.busy, len(order)) == (["at once"], True, 4)
    await until(lambda: "idle" in done)
    assert (done, order.busy) == (["at once", "first", "second", "idle"], False)


async def test_what_is_forgotten_is_not_done() -> None:
    done = list[str]()
    order = InOrder(partial(done.append, "idle"))
    order.wait(0.0)
    order.do(partial(done.append, "late"))
    order.forget()
    assert (order.busy, len(order)) == (False, 0)
    order.do(partial(done.append, "afterwards"))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert done == ["afterwards"]
