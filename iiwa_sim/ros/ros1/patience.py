"""rospy's servers where they would end, spin, or let one client keep all others waiting. Needs rospy."""

import contextlib
import socket
import threading
from collections.abc import Callable
from typing import Any

from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rospy.impl.tcpros_base import TCPServer

from iiwa_sim.serve.listening import wait_if_used_up


def accept_patiently() -> None:
    """For all servers of rospy's that this process will make.

    Where no descriptor is left, its server of topics and services would end for good, and its server of
    XML-RPC try again and again without a pause. The former would also hear nobody while somebody who has
    connected does not say what for.
    """
    of_topics, of_xmlrpc = TCPServer._create_server_sock, ThreadingXMLRPCServer.get_request

    def create_server_sock(server: Any) -> Any:
        server.inbound_handler = _in_a_thread(server.inbound_handler)
        return _PatientListener(of_topics(server))

    def get_request(server: Any) -> Any:
        try:
            return of_xmlrpc(server)
        except OSError as fault:
            wait_if_used_up(fault)
            raise

    TCPServer._create_server_sock = create_server_sock
    ThreadingXMLRPCServer.get_request = get_request


def _in_a_thread(handler: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    def handle(connection: Any, address: Any) -> None:
        with contextlib.suppress(OSError):  # who knocked has gone
            handler(connection, address)

    def begin(connection: Any, address: Any) -> None:
        threading.Thread(target=handle, args=(connection, address), name="ros-inbound", daemon=True).start()

    return begin


class _PatientListener:
    """A listening socket."""

    def __init__(self, listening: socket.socket) -> None:
        self._listening = listening

    def __getattr__(self, name: str) -> Any:
        return getattr(self._listening, name)

    def accept(self) -> Any:
        while True:
            try:
                return self._listening.accept()
            except OSError as fault:
                if not wait_if_used_up(fault):
                    raise
