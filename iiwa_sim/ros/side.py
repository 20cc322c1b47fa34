"""The ROS side of a robot: its node, and the transports by which others reach it."""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from iiwa_sim.controller.controller import Controller
from iiwa_sim.options.model import Settings
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.arm.joint_level import JointLevel
from iiwa_sim.ros.conventions import SIMULATED, RosFault
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.rmi.node import Node
from iiwa_sim.ros.rosbridge.mac import Secret
from iiwa_sim.ros.rosbridge.outbox import Outbox
from iiwa_sim.ros.rosbridge.rosapi import RosApi
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.server import close_all, start_all
from iiwa_sim.server.token import secret_in
from iiwa_sim.server.web_access import WebAccess

if TYPE_CHECKING:
    from iiwa_sim.ros.ros1.node import Ros1Node
    from iiwa_sim.ros.ros2.node import Ros2Node
    from iiwa_sim.ros.rosbridge.server import RosbridgeServer
    from iiwa_sim.ros.rosbridge.session import RosbridgeSession

ROSBRIDGE_LIBRARIES = ("websockets", "cbor2")
SYSTEM_PACKAGES = Path("/usr/lib/python3/dist-packages")
"""Where Debian's and Ubuntu's packages are, which a virtual environment does not see."""


class RosSide:
    """A robot on ROS, as its settings say, from `start` to `close`.

    Raises RosFault if a library is missing; `start` raises ListenFault, and RosFault if there can be no node.
    """

    def __init__(
        self,
        controller: Controller,
        log: ProtocolLog,
        settings: Settings,
        *,
        on_heard: Callable[[], None],
        budget: Budget,
    ) -> None:
        """`on_heard` is called after a message that may have started a command; `budget` is shared with the
        other servers of the loop."""
        tick_rate_hz = settings.rate_hz
        access = WebAccess(settings.rosbridge_origin, settings.rosbridge_host)
        now_ns = time.time_ns
        if settings.ros_stamps == SIMULATED:

            def now_ns() -> int:
                return round(1e9 * controller.tick * controller.tick_s)

        self._node = Node(controller, now_ns, tick_rate_hz, log, settings.ros_result, settings.ros_reference)
        self._arm = JointLevel(controller, now_ns, tick_rate_hz, log)
        graph = Graph(self._node, self._arm)
        self._rosbridge: RosbridgeServer | None = None
        self._ros1: Ros1Node | None = None
        if settings.rosbridge_port is not None:
            file = settings.rosbridge_secret
            secret = None if file is None else Secret(secret_in(file), time.time_ns)
            address = settings.host, settings.rosbridge_port
            self._rosbridge = _rosbridge(graph, log, address, secret, on_heard, budget, access)
        if settings.ros:
            self._ros1 = _ros1(self._node, log, on_heard, budget)
        self._ros2: Ros2Node | None = None
        if settings.ros2:
            python = None if settings.ros2_python is None else Path(settings.ros2_python)
            namespace = settings.ros_namespace
            self._ros2 = _ros2(graph, python, namespace, log, on_heard, budget)

    def tick(self) -> None:
        """Step node and arm; to be called after every tick."""
        self._node.step()
        self._arm.step()

    def skip(self, ticks: int) -> None:
        """Notice that a robot at rest has made so many ticks at once, when nobody was `watching`."""
        self._node.skip(ticks)
        self._arm.skip(ticks)

    async def start(self) -> None:
        """Start serving. Raises ListenFault and RosFault, and then nothing is left open."""
        await start_all(self._transports)

    async def close(self) -> None:
        """Stop serving."""
        await close_all(self._transports)

    @property
    def _transports(self) -> "list[RosbridgeServer | Ros1Node | Ros2Node]":
        return [each for each in (self._rosbridge, self._ros1, self._ros2) if each is not None]

    @property
    def watching(self) -> bool:
        """Whether somebody hears a topic, or a command waits: each tick is wanted then."""
        return self._node.watching or self._arm.watching

    @property
    def has_commands(self) -> bool:
        """Whether a coming tick will send a command to the robot or report the end of one."""
        return self._node.has_commands

    @property
    def rosbridge_address(self) -> tuple[str, int] | None:
        """Host and port of rosbridge, if it is served."""
        return None if self._rosbridge is None else self._rosbridge.address

    @property
    def ros2_node(self) -> str | None:
        """The name of the node of ROS 2, if there is one."""
        return None if self._ros2 is None else self._ros2.name

    @property
    def ros_master(self) -> str | None:
        """URI of the ROS master at which the robot is a node, if it is one."""
        return None if self._ros1 is None else self._ros1.master


def _rosbridge(
    graph: Graph,
    log: ProtocolLog,
    address: tuple[str, int],
    secret: Secret | None,
    on_heard: Callable[[], None],
    budget: Budget,
    access: WebAccess,
) -> "RosbridgeServer":
    try:
        from iiwa_sim.ros.rosbridge.server import RosbridgeServer
        from iiwa_sim.ros.rosbridge.session import RosbridgeSession
    except ModuleNotFoundError as fault:
        missing = (fault.name or "").partition(".")[0]
        if missing not in ROSBRIDGE_LIBRARIES:
            raise
        raise RosFault(f"rosbridge needs {missing}: pip install -e '.[rosbridge]'") from None
    api = RosApi(graph.node)

    def open_session(name: str, wake: Callable[[], None]) -> "tuple[RosbridgeSession, Outbox]":
        outbox = Outbox(wake)
        session = RosbridgeSession(graph, api, outbox, log, name, secret=secret)
        return session, outbox

    return RosbridgeServer(open_session, *address, on_heard, budget, access)


def _ros1(node: Node, log: ProtocolLog, on_heard: Callable[[], None], budget: Budget) -> "Ros1Node":
    if (SYSTEM_PACKAGES / "rospy").is_dir() and str(SYSTEM_PACKAGES) not in sys.path:
        sys.path.append(str(SYSTEM_PACKAGES))  # appended, so that it never hides a package of the environment
    try:
        from iiwa_sim.ros.ros1.node import Ros1Node
    except ModuleNotFoundError as fault:
        if (fault.name or "").partition(".")[0] == "iiwa_sim":
            raise
        raise RosFault(
            f"--ros needs rospy ({fault}): on Debian and Ubuntu, apt install python3-rospy, or source the "
            "setup.bash of a ROS 1"
        ) from None
    return Ros1Node(node, log, on_heard, budget)


def _ros2(
    graph: Graph,
    python: Path | None,
    namespace: str,
    log: ProtocolLog,
    on_heard: Callable[[], None],
    budget: Budget,
) -> "Ros2Node":
    from iiwa_sim.ros.ros2.environment import found_python
    from iiwa_sim.ros.ros2.node import Ros2Node

    return Ros2Node(graph, python or found_python(), namespace, log, on_heard, budget)
