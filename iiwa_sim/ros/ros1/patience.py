"""Patches of rospy's servers, which would end, spin, or let one client block all others. Needs rospy."""

import contextlib
import socket
import threading
from collections.abc import Callable
from typing import Any

from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rospy.impl.tcpros_base import TCPServer

from iiwa_sim.serve.listening import wait_if_used_up


def accept_patiently() -> None:
    """Patch all servers that rospy makes in this process.

    Without free descriptors, rospy's server of topics and services would end for good, and its XML-RPC server
    would retry without a pause, as it would when rospy has closed it. The former would also accept nobody
    while a connected client sends no header.
    """
    of_topics, of_xmlrpc = TCPServer._create_server_sock, ThreadingXMLRPCServer.get_request

    def create_server_sock(server: Any) -> Any:
        server.inbound_handler = _in_a_thread(server.inbound_handler)
        return _PatientListener(of_topics(server))

    def get_request(server: Any) -> Any:
        try:
            return of_xmlrpc(server)
        except OSError as fault:
            if server.socket.fileno() < 0:  # not as an OSError, which would be retried without end
                raise RuntimeError("rospy has closed its XML-RPC server") from fault
            wait_if_used_up(fault)
            raise

    TCPServer._create_server_sock = create_server_sock
    ThreadingXMLRPCServer.get_request = get_request


def _in_a_thread(handler: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    def handle(connection: Any, address: Any) -> None:
        with contextlib.suppress(OSError):  # the client has gone
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
