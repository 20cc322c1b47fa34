"""The ROS side of a robot: its node, and the fronts through which others reach it."""

import time
from collections.abc import Callable

from iiwa_sim.dialect.log import DialectLog
from iiwa_sim.dialect.rmi.mac import Secret
from iiwa_sim.dialect.rmi.node import Node
from iiwa_sim.dialect.rmi.outbox import Outbox
from iiwa_sim.dialect.rmi.robot import Robot
from iiwa_sim.dialect.rmi.rosapi import RosApi
from iiwa_sim.dialect.rmi.rosbridge import RosbridgeSession
from iiwa_sim.ros.fault import RosFault


class RosSide:
    """A robot on rosbridge: listens from `start` to `close`.

    With a secret clients have to show that they know it. Stamps are real time. Raises RosFault where the
    library websockets is not installed; `start` raises ListenFault.
    """

    def __init__(
        self,
        robot: Robot,
        tick_rate_hz: int,
        log: DialectLog,
        *,
        host: str,
        rosbridge_port: int,
        rosbridge_secret: str | None = None,
        on_heard: Callable[[], None],
    ) -> None:
        """`on_heard` is called when a client has said something that may have set off a command."""
        try:
            from iiwa_sim.serve.rosbridge import RosbridgeServer
        except ModuleNotFoundError as fault:
            if (fault.name or "").partition(".")[0] != "websockets":
                raise
            raise RosFault("rosbridge needs websockets: pip install 'iiwa-sim[rosbridge]'") from None
        node = Node(robot, time.time_ns, tick_rate_hz, log)
        api = RosApi(node, time.time_ns)
        secret = None if rosbridge_secret is None else Secret(rosbridge_secret, time.time_ns)
        self._node = node
        self.step = node.step
        """To be called after every tick."""

        def open_session(name: str, wake: Callable[[], None]) -> tuple[RosbridgeSession, Outbox]:
            outbox = Outbox(wake)
            return RosbridgeSession(node, api, outbox, log, name, secret=secret), outbox

        self._server = RosbridgeServer(open_session, host, rosbridge_port, on_heard)
        self.start, self.close = self._server.start, self._server.close

    @property
    def has_commands(self) -> bool:
        """Whether the next ticks will send a command to the robot or tell of one's end."""
        return self._node.has_commands

    @property
    def rosbridge_address(self) -> tuple[str, int]:
        """Host and port listened on."""
        return self._server.address
