"""A KRC4 client, written with the standard library's XML as a driver might be."""

from __future__ import annotations

import socket
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import NamedTuple, Self

from tests.line_client import DEADLINE_S

IDS = {
    "STO": 1,
    "LIN": 10,
    "LIA": 15,
    "PTP": 20,
    "PTA": 25,
    "FIN": 100,
    "SIO": 200,
    "GIO": 210,
    "DIS": 300,
    "GOP": 310,
    "GOA": 320,
}
FULL = {f"I{place}": "0" for place in range(10)} | {f"R{place}": "0.0" for place in range(10)}
"""The values of a reply."""


class Reply(NamedTuple):
    id: int
    command: int
    integers: tuple[int, ...]
    """I0 to I9"""
    reals: tuple[float, ...]
    """R0 to R9"""

    @property
    def error(self) -> int | None:
        """The error number, if the message was refused."""
        return self.integers[2] if self.command < 0 else None


def elements(tag: str, values: Mapping[str, object]) -> bytes:
    """Return a message with its values as child elements."""
    root = ET.Element(tag)
    for name, value in values.items():
        ET.SubElement(root, name).text = str(value)
    return ET.tostring(root)


def attributes(tag: str, values: Mapping[str, object]) -> bytes:
    """Return an element of XML without children, whose attributes are the values."""
    return ET.tostring(ET.Element(tag, {name: str(value) for name, value in values.items()}))


def request(message_id: int, tag: str, *reals: float, **integers: int) -> bytes:
    """Return a message with child elements: reals from R0 on, and integers by their names."""
    numbers = {f"R{place}": value for place, value in enumerate(reals)}
    return elements("Cmd", {"I0": message_id, "I1": IDS[tag], **integers, **numbers})


def replies(wire: bytes) -> list[Reply]:
    """Return the replies in bytes, which must contain whole replies only."""
    found = []
    for root in ET.fromstring(b"<all>" + wire + b"</all>"):
        assert root.tag == "Res"
        assert root.text is None
        assert [child.tag for child in root] == [f"{kind}{place}" for kind in "IR" for place in range(10)]
        texts = [child.text or "" for child in root]
        integers, reals = tuple(map(int, texts[:10])), tuple(map(float, texts[10:]))
        found.append(Reply(integers[0], integers[1], integers, reals))
    return found


class Krc4Client:
    """A driver on a socket of its own; every wait has a deadline."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=DEADLINE_S)
        self._messages = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def ask(self, tag: str, *reals: float, **integers: int) -> Reply:
        self._messages += 1
        self.send(request(self._messages, tag, *reals, **integers))
        reply = self.reply()
        assert reply.id == self._messages
        assert abs(reply.command) == IDS[tag]
        return reply

    def send(self, wire: bytes) -> None:
        self._socket.sendall(wire)

    def sends_no_more(self) -> None:
        self._socket.shutdown(socket.SHUT_WR)

    def reply(self) -> Reply:
        """Return the next reply."""
        (reply,) = replies(self.reply_bytes())
        return reply

    def reply_bytes(self) -> bytes:
        """Return the bytes of the next reply, up to the end of its root."""
        wire = b""
        while not wire.endswith(b"</Res>"):
            came = self._socket.recv(1)
            assert came, "the connection ended"
            wire += came
        return wire

    def rest(self) -> bytes:
        """Return all further bytes up to the end of the connection."""
        wire = b""
        while came := self._socket.recv(4096):
            wire += came
        return wire
