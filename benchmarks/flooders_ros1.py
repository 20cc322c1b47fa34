"""Load generators for ROS 1, in the bytes of its protocols; the master is that of Debian's packages.

How publishers, subscribers and callers connect: https://wiki.ros.org/ROS/TCPROS.
"""

import contextlib
import os
import shutil
import socket
import subprocess
import tempfile
import threading
import time
import xmlrpc.client
from collections.abc import Iterator
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import msgspec

from benchmarks.flooders import Address, Flood
from iiwa_sim.ros.rmi.definitions import message, message_md5, service, service_md5, type_of
from iiwa_sim.ros.rmi.serialized import serialized
from iiwa_sim.ros.side import SYSTEM_PACKAGES

LISTS, LIST = "/command_list", "robot_movement_interface/CommandList"
CALLED, CALL = "/get_io", "robot_movement_interface/GetIO"
STARTING_S = 30.0


def is_there() -> bool:
    """Whether a master can be started, and the robot can be a node."""
    return (SYSTEM_PACKAGES / "rospy").is_dir() and shutil.which("rosmaster") is not None


@contextlib.contextmanager
def master() -> Iterator[Address]:
    """Start a private master; the environment names it."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        address: Address = free.getsockname()
    with tempfile.TemporaryDirectory() as home:
        here = {"ROS_MASTER_URI": _uri(address), "ROS_IP": "127.0.0.1", "ROS_HOME": home}
        before = {name: os.environ.get(name) for name in here}
        os.environ.update(here)
        command = ["rosmaster", "--core", "-p", str(address[1])]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        with subprocess.Popen(command, env=environment, **quiet) as process:
            try:
                _until_it_answers(address)
                yield address
            finally:
                process.terminate()
                process.wait()
                for name, value in before.items():
                    if value is None:
                        del os.environ[name]
                    else:
                        os.environ[name] = value


def callers(address: Address, count: int) -> list[socket.socket]:
    """Connections that call a service repeatedly; `address` is that of the master."""
    with xmlrpc.client.ServerProxy(_uri(address)) as proxy:
        found: Any = proxy.lookupService("/flood", CALLED)
    host, _, port = found[2].removeprefix("rosrpc://").rstrip("/").rpartition(":")
    fields = {"callerid": "/flood", "service": CALLED, "md5sum": service_md5(CALL), "persistent": "1"}
    connections = []
    for _ in range(count):
        connection = socket.create_connection((host, int(port)), timeout=30)
        connection.sendall(_header(fields))
        _take_header(connection)
        connections.append(connection)
    return connections


def publishers(address: Address, count: int) -> list[socket.socket]:
    """Connections by which the robot subscribes to `count` publishers of command lists."""
    fields = {"callerid": "/flood", "topic": LISTS, "type": LIST, "md5sum": message_md5(LIST)}
    with (
        socket.create_server(("127.0.0.1", 0), backlog=count) as listening,
        SimpleXMLRPCServer(("127.0.0.1", 0), _AtAnyPath, logRequests=False) as server,
        xmlrpc.client.ServerProxy(_uri(address)) as proxy,
    ):
        offered = ["TCPROS", *listening.getsockname()]
        server.register_function(lambda *_: [1, "", offered], "requestTopic")
        threading.Thread(target=server.serve_forever, daemon=True).start()
        for number in range(count):
            proxy.registerPublisher(
                f"/flood_{number}", LISTS, LIST, f"{_uri(server.server_address)}/{number}"
            )
        listening.settimeout(STARTING_S)
        connections = []
        for _ in range(count):
            connection, _ = listening.accept()
            connection.settimeout(STARTING_S)
            _take_header(connection)
            connection.sendall(_header(fields))
            connections.append(connection)
        server.shutdown()
    return connections


def floods() -> tuple[Flood, ...]:
    """The floods: calls, and malformed command lists of publishers."""
    wrong = msgspec.convert({"commands": [{"command_type": "CIRC"}] * 200}, type_of(message(LIST)))
    return (
        Flood("ros1", "calls", _packed(serialized(service(CALL).request, {"number": 1})), callers),
        Flood("ros1", "lists", _packed(serialized(message(LIST), msgspec.to_builtins(wrong))), publishers),
    )


class _AtAnyPath(SimpleXMLRPCRequestHandler):
    """One server that acts as many nodes, which differ in the path of their URIs."""

    rpc_paths = ()


def _until_it_answers(address: Address) -> None:
    end_s = time.monotonic() + STARTING_S
    while True:
        try:
            with xmlrpc.client.ServerProxy(_uri(address)) as proxy:
                proxy.getPid("/flood")
                return
        except OSError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.05)


def _uri(address: Any) -> str:
    return f"http://{address[0]}:{address[1]}"


def _packed(data: bytes) -> bytes:
    return len(data).to_bytes(4, "little") + data


def _header(fields: dict[str, str]) -> bytes:
    return _packed(b"".join(_packed(f"{name}={value}".encode()) for name, value in fields.items()))


def _take_header(connection: socket.socket) -> None:
    length = int.from_bytes(connection.recv(4, socket.MSG_WAITALL), "little")
    connection.recv(length, socket.MSG_WAITALL)
