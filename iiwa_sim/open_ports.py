"""What a simulator listens on: which ports and nodes there are, and in which order they open and close."""

from collections.abc import Mapping
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

from iiwa_sim.server.server import close_all
from iiwa_sim.server.status_stream import StatusStream
from iiwa_sim.server.tcp import TcpServer

if TYPE_CHECKING:
    from iiwa_sim.backdoor.http import BackdoorHttp
    from iiwa_sim.ros.side import RosSide


class OpenPorts:
    """The ports of one simulator; of each that it was not asked for there is None."""

    _servers: Mapping[str, TcpServer]
    """One for each protocol, in the order in which they were named."""
    _status: StatusStream | None
    _ros: "RosSide | None"
    _backdoor_http: "BackdoorHttp | None"

    @property
    def host(self) -> str:
        """Address listened on."""
        return self._first.address[0]

    @property
    def port(self) -> int:
        """Port listened on, that of the first protocol."""
        return self._first.address[1]

    @property
    def ports(self) -> dict[str, int]:
        """Port of each protocol, in the order in which they were named."""
        return {name: server.address[1] for name, server in self._servers.items()}

    @property
    def _first(self) -> TcpServer:
        return next(iter(self._servers.values()))

    @property
    def status_port(self) -> int | None:
        """Port on which the state is broadcast, if it is."""
        return None if self._status is None else self._status.address[1]

    @property
    def rosbridge_port(self) -> int | None:
        """Port on which the robot is on ROS by rosbridge, if it is."""
        address = None if self._ros is None else self._ros.rosbridge_address
        return None if address is None else address[1]

    @property
    def ros2_node(self) -> str | None:
        """The name of the node of ROS 2 that the robot is, if it is one."""
        return None if self._ros is None else self._ros.ros2_node

    @property
    def ros_master(self) -> str | None:
        """The ROS master of which the robot is a node, if it is."""
        return None if self._ros is None else self._ros.ros_master

    @property
    def backdoor_port(self) -> int | None:
        """Port of the backdoor, if it has one."""
        return None if self._backdoor_http is None else self._backdoor_http.address[1]

    @property
    def _runs(self) -> bool:
        return any(server.listening for server in self._servers.values())

    @property
    def _listeners(self) -> "list[TcpServer | StatusStream | RosSide | BackdoorHttp]":
        """Listeners in the order of opening: who has reached the robot's own port finds all others open."""
        others = [each for each in (self._status, self._ros, self._backdoor_http) if each is not None]
        return [*others, *self._servers.values()]

    async def _open(self, opened: AsyncExitStack) -> None:
        """Open them all; `opened` closes them again. Raises ListenFault and RosFault."""
        for server in self._listeners:
            await server.start()
            opened.push_async_callback(server.close)

    async def _close(self) -> None:
        """Close them all, the last opened first."""
        await close_all(self._listeners)
