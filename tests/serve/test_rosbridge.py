"""The WebSocket side of rosbridge: who is heard when, with sessions that say what a message costs."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from websockets.asyncio.client import connect

from iiwa_sim.dialect.rmi.outbox import Outbox
from iiwa_sim.serve.rosbridge import RosbridgeServer
from tests.talking import DEADLINE_S

COSTLY, CHEAP = "costly", "cheap"


class Time:
    """What the processor has spent on this thread."""

    def __init__(self) -> None:
        self.spent_s = 0.0

    def __call__(self) -> float:
        return self.spent_s


class Session:
    """Answers everything, and spends time on some of it."""

    closing = False

    def __init__(self, heard: list[str], outbox: Outbox, time: Time) -> None:
        self._heard = heard
        self._outbox = outbox
        self._time = time

    def receive(self, text: bytes) -> None:
        said = text.decode()
        self._heard.append(said)
        self._time.spent_s += 200.0 if said == COSTLY else 0.0
        self._outbox.reply(said)

    def end(self) -> None: ...


async def test_while_a_flooder_has_used_up_its_share_all_others_are_answered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    time, heard = Time(), list[str]()
    monkeypatch.setattr("iiwa_sim.serve.rosbridge.thread_time", time)

    def open_session(_: str, wake: Callable[[], None]) -> tuple[Session, Outbox]:
        outbox = Outbox(wake)
        return Session(heard, outbox, time), outbox

    server = RosbridgeServer(open_session, "127.0.0.1", 0, lambda: None)
    await server.start()
    url = f"ws://127.0.0.1:{server.address[1]}"
    async with connect(url, close_timeout=0.1) as flooder, connect(url) as other, asyncio.timeout(DEADLINE_S):
        for _ in range(10):
            await flooder.send(COSTLY)
        for k in range(300):
            await other.send(CHEAP)
            assert await other.recv() == CHEAP
            assert heard.count(CHEAP) == k + 1
        assert heard.count(COSTLY) == 1, "the others wait until it has rested for 4,000 s"
    await server.close()
