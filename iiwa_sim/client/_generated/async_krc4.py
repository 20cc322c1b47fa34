"""The KRC4 messages, each as a method to be awaited.

Written by `python -m tools.client_source` from protocol/krc4.toml: not to be changed by hand.
"""

from collections.abc import Sequence

from iiwa_sim.client.asynchronous import AsyncConnection
from iiwa_sim.client.exchange import exactly
from iiwa_sim.client.messages import KRC4, Message, Reply, as_axes, flag, message, nothing, real, reals
from iiwa_sim.client.replies import Krc4Frame


class AsyncKrc4(AsyncConnection[Message, Reply]):
    """A robot of so many axes at the other end of a connection, one method per message."""

    _language = KRC4

    def __init__(self, host: str, port: int, timeout_s: float = 5.0, *, axes: int = 6) -> None:
        """`timeout_s` bounds the time to connect and the wait for each reply.

        No message tells how many axes the robot has. Raises ValueError for less than 1 or more than 10.
        """
        self._axes = as_axes(axes)
        super().__init__(host, port, timeout_s)

    async def sto(self) -> None:
        """Stops the robot on its path and forgets the moves that wait."""
        await self._do(message(nothing, "STO"))

    async def lin(self, target: Sequence[float]) -> None:
        """Moves the TCP on a straight line to a frame in the base.

        target: X Y Z (mm) A B C (deg)
        """
        await self._do(message(nothing, "LIN", reals=exactly(6, "target", target)))

    async def lia(self, joints_deg: Sequence[float]) -> None:
        """Moves the TCP on a straight line to where it is at joint positions.

        joints_deg: A1 A2 .. of all axes (deg)
        """
        await self._do(message(nothing, "LIA", reals=exactly(self._axes, "joints_deg", joints_deg)))

    async def ptp(self, target: Sequence[float]) -> None:
        """Moves all joints together to a frame of the TCP in the base.

        target: X Y Z (mm) A B C (deg)
        """
        await self._do(message(nothing, "PTP", reals=exactly(6, "target", target)))

    async def pta(self, joints_deg: Sequence[float]) -> None:
        """Moves all joints together to joint positions.

        joints_deg: A1 A2 .. of all axes (deg)
        """
        await self._do(message(nothing, "PTA", reals=exactly(self._axes, "joints_deg", joints_deg)))

    async def fin(self) -> bool:
        """Tells whether the robot is idle: in a pause, and while it stops, it is not.

        returns True idle, False moving
        """
        return await self._do(message(flag(2), "FIN"))

    async def sio(self, number: int, on: bool) -> None:
        """Switches a digital output.

        number: number of the IO, an output
        """
        await self._do(message(nothing, "SIO", integers=[number, int(on)]))

    async def gio(self, number: int) -> bool:
        """Gives the state of a digital output or input.

        number: number of the IO: outputs from 1 on, inputs behind them
        returns True on, False off
        """
        return await self._do(message(flag(3), "GIO", integers=[number]))

    async def dis(self) -> float:
        """Gives how far the TCP is from the end of the move under way, in a straight line.

        returns distance (mm)
        """
        return await self._do(message(real(0), "DIS"))

    async def gop(self) -> Krc4Frame:
        """Gives the frame of the TCP at the end of the move under way, at rest where it is.

        returns X Y Z (mm) A B C (deg)
        """
        return await self._do(message(reals(Krc4Frame._make, 6), "GOP"))

    async def goa(self) -> tuple[float, ...]:
        """Gives the joint positions at the end of the move under way, at rest where they are.

        returns A1 A2 .. of all axes (deg)
        """
        return await self._do(message(reals(tuple, self._axes), "GOA"))
