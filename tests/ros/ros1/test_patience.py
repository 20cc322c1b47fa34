"""What becomes of rospy's servers; with Debian's packages of ROS 1."""

from __future__ import annotations

import subprocess
import sys

from iiwa_sim.ros.side import SYSTEM_PACKAGES
from tests.ros1_tools import needs_ros
from tests.talking import DEADLINE_S

CLOSED = f"""
import contextlib, sys, threading, xmlrpc.client
sys.path.append({str(SYSTEM_PACKAGES)!r})
from rosgraph.xmlrpc import XmlRpcHandler, XmlRpcNode
from iiwa_sim.ros.ros1.patience import accept_patiently

accept_patiently()
begun = threading.Event()

class Handler(XmlRpcHandler):
    def _ready(self, uri):
        begun.set()

node = XmlRpcNode(0, Handler())
thread = threading.Thread(target=node.run, daemon=True)
thread.start()
begun.wait({DEADLINE_S})
with contextlib.suppress(xmlrpc.client.Fault), xmlrpc.client.ServerProxy(node.uri) as proxy:
    proxy.nothing()  # once it is answered, the server serves
node.shutdown("another node has its name")
thread.join({DEADLINE_S} / 2)
print("spins" if thread.is_alive() else "ended")
"""


def test_an_xmlrpc_server_that_is_closed_ends_its_thread() -> None:
    """rospy closes it where another node takes this one's name, and the robot goes on without a node."""
    needs_ros()
    command = [sys.executable, "-c", CLOSED]  # rospy changes the loggers of its process
    done = subprocess.run(command, capture_output=True, text=True, timeout=2 * DEADLINE_S, check=False)
    assert done.stdout == "ended\n", done.stderr
