"""The bridge: polls a robot behind a connection and publishes its state on ROS."""

import asyncio
import contextlib
import logging
from types import TracebackType
from typing import Self

from iiwa_sim.client import AsyncIiwa, ReplyError
from iiwa_sim.log import SessionLog
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.ros.bridge.arm import NO_TRAJECTORIES, RemoteArm
from iiwa_sim.ros.conventions import RosOptions
from iiwa_sim.ros.fault import BridgeFault
from iiwa_sim.ros.side import RosSide
from iiwa_sim.serve.listening import host_and_port, why

RATE_HZ = 100
"""Polling rounds per second, if the connection is fast enough for them."""
RECONNECT_S = 1.0

logger = logging.getLogger(__name__)


class Bridge:
    """The robot at `server` is on ROS while the context is open.

    A connection that fails later is reopened, with an attempt every second until one succeeds; pending
    requests and those that come meanwhile fail. Raises RosFault if the library for rosbridge or ROS is not
    installed. Entering the context raises BridgeFault if no robot answers, ListenFault, and RosFault if there
    can be no node.
    """

    def __init__(self, server: tuple[str, int], description: RobotDescription, options: RosOptions) -> None:
        """Raises ValueError for malformed origins and hosts of rosbridge."""
        self._server = server
        self._client = AsyncIiwa(*server)
        self._robot = RemoteArm(self._client, description)
        self._wake = asyncio.Event()
        self._ros = RosSide(self._robot, RATE_HZ, SessionLog(), options, on_heard=self._wake.set)

    @property
    def rosbridge_address(self) -> tuple[str, int] | None:
        """Host and port of rosbridge, if it is served."""
        return self._ros.rosbridge_address

    @property
    def ros2_node(self) -> str | None:
        """The name of the node of ROS 2, if there is one."""
        return self._ros.ros2_node

    @property
    def ros_master(self) -> str | None:
        """URI of the ROS master at which the robot is a node, if it is one."""
        return self._ros.ros_master

    async def __aenter__(self) -> Self:
        try:
            await self._client.reconnect()
            await self._robot.look()
        except (OSError, ReplyError) as fault:
            self._client.close()
            raise BridgeFault(f"no robot at {host_and_port(*self._server)}: {why(fault)}") from None
        try:
            await self._ros.start()
        except BaseException:
            self._client.close()
            raise
        if self._ros.ros2_node is not None:
            logger.info("%s", NO_TRAJECTORIES)
        self._rounds = asyncio.create_task(self._go_on())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        self._rounds.cancel()
        await asyncio.wait([self._rounds])
        await self._ros.close()
        self._client.close()

    async def _go_on(self) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            try:
                await self._robot.do_asked()
                if loop.time() >= due_s:
                    await self._robot.look()
            except (OSError, ReplyError) as fault:
                logger.warning("the connection to the robot failed: %s", why(fault))
                await self._reconnect(fault)
                logger.warning("connected to the robot again")
            if loop.time() >= due_s:
                self._ros.tick()
                due_s = max(due_s + 1.0 / RATE_HZ, loop.time())
            self._wake.clear()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(due_s):
                    await self._wake.wait()

    async def _reconnect(self, fault: Exception) -> None:
        """Return when the robot answers again; requests that come meanwhile fail with the reason."""
        self._robot.give_up(_no_connection(fault))
        loop = asyncio.get_running_loop()
        connecting, due_s = asyncio.create_task(self._connect()), loop.time()
        try:
            while not connecting.done():
                self._ros.tick()
                due_s = max(due_s + 1.0 / RATE_HZ, loop.time())
                await asyncio.wait([connecting], timeout=due_s - loop.time())
        finally:
            connecting.cancel()
            await asyncio.wait([connecting])

    async def _connect(self) -> None:
        while True:
            # Also before the first attempt: a server that accepts and closes at once is not polled in a tight
            # loop.
            await asyncio.sleep(RECONNECT_S)
            try:
                await self._client.reconnect()
                await self._robot.look()
                return
            except (OSError, ReplyError) as fault:
                self._robot.give_up(_no_connection(fault))


def _no_connection(fault: Exception) -> str:
    return f"no connection to the robot: {why(fault)}"
