"""A browser as the page sees one: messages in, messages out, and nothing drawn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from benchmarks.view import CAMERA
from tests.talking import DEADLINE_S

Message = dict[str, Any]


class Viewer:
    """One that is connected."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.seen: list[Message] = []

    def send(self, **message: Any) -> None:
        self.connection.send(msgspec.msgpack.encode(message))

    def until(self, found: Callable[[Message], bool]) -> Message:
        """The first message that is it, of those seen before and those to come."""
        for message in self.seen:
            if found(message):
                return message
        end_s = time.monotonic() + DEADLINE_S
        while time.monotonic() < end_s:
            for message in self._more(end_s - time.monotonic()):
                if found(message):
                    return message
        raise TimeoutError("no such message came")

    def closed(self) -> bool:
        """Whether the page closes the connection, in time."""
        end_s = time.monotonic() + DEADLINE_S
        try:
            while time.monotonic() < end_s:
                self._more(end_s - time.monotonic())
        except ConnectionClosed:
            return True
        return False

    def labelled(self, label: str) -> str:
        """The id of a button or other input."""
        found = self.until(lambda message: message.get("props", {}).get("label") == label)
        return str(found["uuid"])

    def clicks(self, label: str, value: object = True) -> None:
        self.send(type="GuiUpdateMessage", uuid=self.labelled(label), updates={"value": value})

    def commands(self, label: str) -> None:
        """What the command palette does."""
        found = self.until(
            lambda message: message["type"] == "RegisterCommandMessage" and message["props"]["label"] == label
        )
        self.send(type="CommandTriggerMessage", uuid=found["uuid"])

    def drags(self, node: str, phase: str, *end: float) -> None:
        """The mouse at a node of the scene: grabbed at (0.6, 0, 0.6) m, and now at `end`."""
        shown = self.until(lambda message: message.get("name", "").endswith(node) and "props" in message)
        self.send(
            type="SceneNodeDragMessage",
            phase=phase,
            name=shown["name"],
            instance_index=None,
            start_position=(0.6, 0.0, 0.6),
            start_screen_pos=(0.5, 0.5),
            end_position=end,
            end_screen_pos=(0.5, 0.5),
            button="left",
            modifier=None,
            owner=shown.get("owner", ""),
        )

    def _more(self, timeout_s: float) -> list[Message]:
        raw = self.connection.recv(timeout=max(timeout_s, 0.0))
        assert isinstance(raw, bytes)
        size, packed = int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")
        whole = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=size)
        messages: list[Message] = list(msgspec.msgpack.decode(whole)["messages"])
        self.seen += messages
        return messages


@contextmanager
def viewing(port: int, origin: str | None = None, **headers: str) -> Iterator[Viewer]:
    """A viewer that has told where its camera is, from when on it counts as one."""
    with connect(
        f"ws://127.0.0.1:{port}/",
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        origin=None if origin is None else Origin(origin),
        additional_headers=headers,
        compression=None,
        max_size=None,
        open_timeout=DEADLINE_S,
    ) as connection:
        viewer = Viewer(connection)
        viewer.send(**CAMERA)
        yield viewer
