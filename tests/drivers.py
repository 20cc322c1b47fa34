"""Drivers of either protocol over sockets, with deadlines, for tests of both protocols."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

from iiwa_sim.simulator import Simulator
from tests.krc4_client import FULL, Reply, elements, replies, request
from tests.line_client import DEADLINE_S, Client, until


class Driver(Client, ABC):
    """A driver that can ask, move, and recognise a rejection."""

    PROTOCOL: ClassVar[str]
    END: ClassVar[bytes]
    """End of every reply."""
    QUESTIONS: ClassVar[tuple[bytes, ...]]
    """Three questions with constant answers while the robot rests at home."""
    ANSWERS: ClassVar[tuple[bytes, ...]]
    SWITCH_ON: ClassVar[bytes]
    """Command that sets output 1."""

    async def whole_reply(self) -> bytes:
        """Return the next reply with its end."""
        async with asyncio.timeout(DEADLINE_S):
            return await self._reader.readuntil(self.END)

    async def asks(self, message: bytes) -> bytes:
        self.send(message)
        return await self.whole_reply()

    async def is_served(self) -> None:
        """Check that two questions are answered."""
        self.send(b"".join(self.QUESTIONS[:2]))
        assert [await self.whole_reply(), await self.whole_reply()] == list(self.ANSWERS[:2])

    @abstractmethod
    async def moves(self, joints: Sequence[float]) -> int:
        """Move all joints to positions (rad), slowly if the protocol has a speed; return the error, or 0."""


class IiwaDriver(Driver):
    PROTOCOL = "iiwa"
    END = b"\r\n"
    QUESTIONS = (b"hello\r\n", b"get output : 1\r\n", b"get distance to goal\r\n")
    ANSWERS = (b"hello\r\n", b"0\r\n", b"0.0\r\n")
    SWITCH_ON = b"set output : 1 1\r\n"

    async def moves(self, joints: Sequence[float]) -> int:
        numbers = " ".join([*map(repr, joints), *["0.3"] * len(joints)])
        if await self.ask(f"joint move : {numbers}") == "done":
            return 0
        return int((await self.ask("get error")).split()[0])


def _answer(message_id: int, command: int, **values: int) -> bytes:
    return elements("Res", {**FULL, "I0": message_id, "I1": command, **values})


class Krc4Driver(Driver):
    PROTOCOL = "krc4"
    END = b"</Res>"
    QUESTIONS = (request(1, "FIN"), request(2, "GIO", I2=1), request(3, "DIS"))
    ANSWERS = (_answer(1, 100, I2=1), _answer(2, 210), _answer(3, 300))
    SWITCH_ON = request(4, "SIO", I2=1, I3=1)

    async def message(self, tag: str, *reals: float, **integers: int) -> Reply:
        (reply,) = replies(await self.asks(request(9, tag, *reals, **integers)))
        return reply

    async def moves(self, joints: Sequence[float]) -> int:
        return (await self.message("PTA", *[57.29577951308232 * each for each in joints])).error or 0

    async def moving(self) -> bool:
        return (await self.message("FIN")).integers[2] == 0


DRIVERS: dict[str, type[Driver]] = {each.PROTOCOL: each for each in (IiwaDriver, Krc4Driver)}


class Scene(NamedTuple):
    """A robot, its protocols, and the protocol of the tested driver."""

    robot: str
    protocols: tuple[str, ...]
    spoken: str
    far: tuple[float, ...]
    """Joint positions (rad) far from home."""

    def simulator(self, **options: Any) -> Simulator:
        return Simulator(self.robot, protocol=self.protocols, **options)

    @property
    def other(self) -> str:
        """Protocol of another driver: a different one if there are two."""
        return next((name for name in self.protocols if name != self.spoken), self.spoken)


_FAR_OF_SEVEN = (1.0, 1.0, 1.0, -1.5, 1.0, 1.0, 1.0)
SCENES = {
    "krc4": Scene("kr_6_r900_sixx", ("krc4",), "krc4", (2.8, 0.5, -1.5, 0.0, 1.0, 0.0)),
    "iiwa beside krc4": Scene("lbr_iiwa_7_r800", ("krc4", "iiwa"), "iiwa", _FAR_OF_SEVEN),
    "krc4 beside iiwa": Scene("lbr_iiwa_7_r800", ("iiwa", "krc4"), "krc4", _FAR_OF_SEVEN),
}
ONE_OF_EACH_PROTOCOL = ("krc4", "iiwa beside krc4")


async def connect(simulator: Simulator, protocol: str) -> tuple[Driver, int]:
    """Return a driver and the number of its connection."""
    before = set(simulator.backdoor.connections())
    driver = await DRIVERS[protocol].connect(simulator.ports[protocol])
    await until(lambda: len(simulator.backdoor.connections()) == len(before) + 1)
    (number,) = set(simulator.backdoor.connections()) - before
    return driver, number
