"""Load generators: a process with many connections that send without pause and discard the replies."""

import contextlib
import json
import multiprocessing
import multiprocessing.synchronize
import selectors
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

TOPICS = ("/robot_status", "/tool_frame", "/joint_states", "/current_speed_scale", "/io_states")
Address = tuple[str, int]

SETTLING_S = 0.5
CHUNK_BYTES = 65_536
SLOW_BYTES = 2048
"""Bytes that a slow reader reads every SLOW_S."""
SLOW_S = 0.1


def bare(address: Address, count: int) -> list[socket.socket]:
    """Open `count` plain connections."""
    return [socket.create_connection(address, timeout=30) for _ in range(count)]


def websockets(address: Address, count: int) -> list[socket.socket]:
    """Open `count` WebSocket connections."""
    connections = bare(address, count)
    for connection in connections:
        connection.sendall(
            b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        while b"\r\n\r\n" not in connection.recv(4096):
            pass
    return connections


def readers_of_all_states(address: Address, count: int) -> list[socket.socket]:
    """Open subscribers of five topics of rosbridge with small receive buffers."""
    connections = websockets(address, count)
    for connection in connections:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SLOW_BYTES)
        for topic in TOPICS:
            connection.sendall(says("subscribe", topic=topic))
    return connections


def frame(text: bytes, opcode: int = 1) -> bytes:
    """A masked WebSocket frame with a mask of zeros."""
    length = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + len(text).to_bytes(2, "big")
    return bytes([0x80 | opcode]) + length + b"\0\0\0\0" + text


def says(operation: str, **fields: object) -> bytes:
    """A frame with an operation of rosbridge."""
    return frame(json.dumps({"op": operation, **fields}).encode())


class Flood(NamedTuple):
    """What is sent to which port, and the kind of connections."""

    port: str
    what: str
    message: bytes
    """Empty for slow readers, which send nothing."""
    connected: Callable[[Address, int], Sequence[socket.socket]] = bare


@contextlib.contextmanager
def flooding(address: Address, flood: Flood, count: int) -> Iterator[None]:
    """A process that floods until the context ends."""
    begun = multiprocessing.Event()
    flooders = multiprocessing.Process(target=_flood, args=(address, flood, count, begun), daemon=True)
    flooders.start()
    try:
        if not begun.wait(60.0):
            raise RuntimeError("the flood did not begin")
        time.sleep(SETTLING_S)
        yield
    finally:
        flooders.terminate()
        flooders.join()


def _flood(address: Address, flood: Flood, count: int, begun: "multiprocessing.synchronize.Event") -> None:
    connections = flood.connected(address, count)
    begun.set()
    if flood.message:
        _send(connections, flood.message * (CHUNK_BYTES // len(flood.message) + 1))
    else:
        _read_slowly(connections)


def _read_slowly(connections: Sequence[socket.socket]) -> None:
    while True:
        time.sleep(SLOW_S)
        for connection in connections:
            if not connection.recv(SLOW_BYTES):
                raise ConnectionError("the server has gone")


def _send(connections: Sequence[socket.socket], data: bytes) -> None:
    rests: dict[socket.socket, memoryview] = {}
    with selectors.DefaultSelector() as selector:
        for connection in connections:
            connection.setblocking(False)
            rests[connection] = memoryview(data)
            selector.register(connection, selectors.EVENT_READ | selectors.EVENT_WRITE)
        while selector.get_map():
            for key, events in selector.select():
                connection = key.fileobj
                assert isinstance(connection, socket.socket)
                try:
                    if events & selectors.EVENT_READ and not connection.recv(CHUNK_BYTES):
                        raise ConnectionError("the server has gone")
                    if events & selectors.EVENT_WRITE:
                        rests[connection] = rests[connection][
                            connection.send(rests[connection]) :
                        ] or memoryview(data)
                except BlockingIOError:
                    pass
                except ConnectionError:
                    selector.unregister(connection)
