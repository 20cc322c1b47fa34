"""The WebSocket server of rosbridge, with a session of a few words."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from websockets.asyncio.client import connect

from iiwa_sim.ros.rosbridge.outbox import Outbox
from iiwa_sim.ros.rosbridge.server import RosbridgeServer
from iiwa_sim.serve.budget import Budget
from tests.talking import DEADLINE_S


class Counting:
    """Answers each message with five, and publishes five more."""

    closing = False

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        outbox.set_feed("/results", 0.0, 1000)

    def receive(self, text: bytes) -> None:
        for number in range(5):
            self._outbox.reply(f"{text.decode()} {number}")
        for number in range(5):
            self._outbox.feed("/results", f"result {number}".format)

    def end(self) -> None:
        pass


async def test_all_that_waits_is_sent_also_where_there_is_time_for_one_message_at_once() -> None:
    """As on a machine that does something else in the midst of a piece of work."""

    def open_session(_name: str, wake: Callable[[], None]) -> tuple[Counting, Outbox]:
        outbox = Outbox(wake)
        return Counting(outbox), outbox

    in_a_hurry = Budget(now_s=lambda: 0.0)  # each piece should have ended long ago
    server = RosbridgeServer(open_session, "127.0.0.1", 0, lambda: None, budget=in_a_hurry)
    await server.start()
    async with asyncio.timeout(DEADLINE_S), connect("ws://{}:{}".format(*server.address)) as client:
        for word in ("one", "two"):
            await client.send(word)
            heard = [await client.recv() for _ in range(10)]
            assert heard == [f"{word} {k}" for k in range(5)] + [f"result {k}" for k in range(5)]
    await server.close()
