"""Drivers of either protocol, for the tests of what is alike in both: over a socket, with deadlines."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

from iiwa_sim.simulator import Simulator
from tests.krc4_talking import FULL, Reply, elements, replies, request
from tests.talking import DEADLINE_S, Client, until


class Driver(Client, ABC):
    """One that can ask something, move, and tell a refusal."""

    PROTOCOL: ClassVar[str]
    END: ClassVar[bytes]
    """Of every reply."""
    QUESTIONS: ClassVar[tuple[bytes, ...]]
    """Three, which are answered the same while the robot rests at home."""
    ANSWERS: ClassVar[tuple[bytes, ...]]
    SWITCH_ON: ClassVar[bytes]
    """Output 1."""

    async def whole_reply(self) -> bytes:
        """The next one, as it comes."""
        async with asyncio.timeout(DEADLINE_S):
            return await self._reader.readuntil(self.END)

    async def asks(self, message: bytes) -> bytes:
        self.send(message)
        return await self.whole_reply()

    async def is_served(self) -> None:
        """Whether it is answered as ever."""
        self.send(b"".join(self.QUESTIONS[:2]))
        assert [await self.whole_reply(), await self.whole_reply()] == list(self.ANSWERS[:2])

    @abstractmethod
    async def moves(self, joints: Sequence[float]) -> int:
        """Sends all joints to positions (rad), slowly where that can be said; the error, 0 where accepted."""


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
    """A robot, what is spoken to it, and in what the driver that is looked at speaks."""

    robot: str
    protocols: tuple[str, ...]
    spoken: str
    far: tuple[float, ...]
    """Joint positions (rad) some way from home."""

    def simulator(self, **options: Any) -> Simulator:
        return Simulator(self.robot, protocol=self.protocols, **options)

    @property
    def other(self) -> str:
        """What somebody else speaks: another protocol, where there is one."""
        return next((name for name in self.protocols if name != self.spoken), self.spoken)


_FAR_OF_SEVEN = (1.0, 1.0, 1.0, -1.5, 1.0, 1.0, 1.0)
SCENES = {
    "krc4": Scene("kr_6_r900_sixx", ("krc4",), "krc4", (2.8, 0.5, -1.5, 0.0, 1.0, 0.0)),
    "iiwa beside krc4": Scene("lbr_iiwa_7_r800", ("krc4", "iiwa"), "iiwa", _FAR_OF_SEVEN),
    "krc4 beside iiwa": Scene("lbr_iiwa_7_r800", ("iiwa", "krc4"), "krc4", _FAR_OF_SEVEN),
}
ONE_OF_EACH_PROTOCOL = ("krc4", "iiwa beside krc4")


async def connect(simulator: Simulator, protocol: str) -> tuple[Driver, int]:
    """A driver, and its number."""
    before = set(simulator.backdoor.connections())
    driver = await DRIVERS[protocol].connect(simulator.ports[protocol])
    await until(lambda: len(simulator.backdoor.connections()) == len(before) + 1)
    (number,) = set(simulator.backdoor.connections()) - before
    return driver, number
