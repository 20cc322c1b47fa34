"""A browser as the page sees it: messages in, messages out, and no picture."""

from __future__ import annotations

import socket
import threading
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

from iiwa_sim.simulator import Simulator
from iiwa_sim.view.app import run_page
from iiwa_sim.view.connection import Place
from tests.line_client import DEADLINE_S

Message = dict[str, Any]

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (2.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 480,
    "image_width": 640,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""The message of a browser that makes it a viewer."""


class Viewer:
    """A browser that is connected."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.seen: list[Message] = []

    def send(self, **message: Any) -> None:
        self.connection.send(msgspec.msgpack.encode(message))

    def until(self, found: Callable[[Message], bool], since: int = 0) -> Message:
        """Return the first message that is it, of those seen from `since` on and those to come."""
        end_s = time.monotonic() + DEADLINE_S
        while time.monotonic() < end_s:
            for message in self.seen[since:]:
                if found(message):
                    return message
            since = len(self.seen)
            self.more(end_s - time.monotonic())
        raise TimeoutError("no such message came")

    def is_closed(self) -> bool:
        """Return True if the page closes the connection in time."""
        end_s = time.monotonic() + DEADLINE_S
        try:
            while time.monotonic() < end_s:
                self.more(end_s - time.monotonic())
        except ConnectionClosed:
            return True
        return False

    def shows(self, *texts: str, since: int = 0) -> None:
        """Wait until an element has all of these texts at once."""

        def has(message: Message) -> bool:
            return all(
                text in str({**message.get("props", {}), **message.get("updates", {})}) for text in texts
            )

        self.until(has, since)

    def appears(self, node: str) -> Message:
        """Wait until a node of the scene becomes visible whose name ends so."""
        kind = "SetSceneNodeVisibilityMessage"
        return self.until(
            lambda each: each["type"] == kind and each["name"].endswith(node) and each["visible"]
        )

    def labelled(self, label: str) -> str:
        """Return the id of a button or another input."""
        return str(self.until(lambda message: message.get("props", {}).get("label") == label)["uuid"])

    def clicks(self, label: str, value: object = True) -> None:
        self.send(type="GuiUpdateMessage", uuid=self.labelled(label), updates={"value": value})

    def types(self, label: str, text: str) -> None:
        """Write a line into a form, and Enter."""
        uuid = self.labelled(label)
        self.clicks(label, text)
        form = self.until(lambda message: message.get("uuid") == uuid)["container_uuid"]
        self.send(type="GuiFormSubmitMessage", uuid=form)

    def drags(self, node: str, phase: str, *end: float) -> None:
        """Drag a node of the scene, grabbed at (0.6, 0, 0.6) m, to `end`."""
        shown = self.until(lambda each: each.get("name", "").endswith(f"{node}/0") and "props" in each)
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

    def more(self, timeout_s: float) -> None:
        """Receive the next messages."""
        raw = self.connection.recv(timeout=max(timeout_s, 0.0))
        assert isinstance(raw, bytes)
        size, packed = int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")
        whole = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=size)
        self.seen += msgspec.msgpack.decode(whole)["messages"]


@contextmanager
def viewing(port: int, origin: str | None = None, **headers: str) -> Iterator[Viewer]:
    """Connect a viewer and send its camera, from when on it counts as one."""
    with connect(
        f"ws://127.0.0.1:{port}/",
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        origin=None if origin is None else Origin(origin),
        additional_headers=headers,
        compression=None,
        max_size=None,
        open_timeout=DEADLINE_S,
        close_timeout=0.05,
    ) as connection:
        viewer = Viewer(connection)
        viewer.send(**CAMERA)
        yield viewer


def place_of(simulator: Simulator, name: str = "", driver: bool = True) -> Place:
    """Return the addresses of a robot with a backdoor."""
    assert simulator.backdoor_port is not None
    here = "127.0.0.1"
    return Place(
        name=name,
        backdoor=(here, simulator.backdoor_port),
        driver=(here, simulator.port) if driver else None,
    )


@contextmanager
def page_at(*places: Place) -> Iterator[int]:
    """Serve a page of robots, and yield its port."""
    over = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        page = threading.Thread(target=run_page, args=(listening, places, over))
        page.start()
        try:
            yield listening.getsockname()[1]
        finally:
            over.set()
            page.join(DEADLINE_S)
            assert not page.is_alive()
