"""A WebSocket server for rosbridge: who connects gets a session of messages. Needs the library websockets."""

from collections.abc import Callable

from iiwa_sim.ros.rosbridge.connection import RosbridgeConnection
from iiwa_sim.ros.rosbridge.outbox import Outbox
from iiwa_sim.ros.rosbridge.session import RosbridgeSession
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.server import Server
from iiwa_sim.server.web_access import WebAccess

SYSTEM_BYTES = 16_384
"""Size of the system's buffers each way: small, so that a slow client gets recent messages."""


class RosbridgeServer(Server[RosbridgeConnection]):
    """Serves every connection to `host`:`port` that has access, whatever path it asks for."""

    def __init__(
        self,
        open_session: Callable[[str, Callable[[], None]], tuple[RosbridgeSession, Outbox]],
        host: str,
        port: int,
        on_heard: Callable[[], None],
        budget: Budget,
        access: WebAccess,
    ) -> None:
        """`open_session` gets the client's name and a function to call when there is something to send.

        `on_heard` is called after messages. `budget` is shared with other servers of the loop.
        """
        super().__init__(lambda: RosbridgeConnection(self), host, port, budget, system_bytes=SYSTEM_BYTES)
        self.open_session = open_session
        self.on_heard = on_heard
        self.access = access
