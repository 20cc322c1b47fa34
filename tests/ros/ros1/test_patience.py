"""What becomes of rospy's servers; with Debian's packages of ROS 1."""

from __future__ import annotations

import threading

from tests.ros1_tools import needs_ros, see_system_packages
from tests.talking import DEADLINE_S


def test_an_xmlrpc_server_that_is_closed_ends_its_thread() -> None:
    """rospy closes it where another node takes this one's name, and the robot goes on without a node."""
    needs_ros()
    see_system_packages()
    from rosgraph.xmlrpc import XmlRpcHandler, XmlRpcNode  # noqa: PLC0415  # found only now

    from iiwa_sim.ros.ros1.patience import accept_patiently  # noqa: PLC0415

    accept_patiently()
    begun = threading.Event()

    class Handler(XmlRpcHandler):
        def _ready(self, _: str) -> None:
            begun.set()

    node = XmlRpcNode(0, Handler())
    thread = threading.Thread(target=node.run, daemon=True)
    thread.start()
    assert begun.wait(DEADLINE_S)
    node.shutdown("another node has its name")
    thread.join(DEADLINE_S)
    assert not thread.is_alive()
