"""The other end of KRC4 messages: written with the standard library's XML, as a driver might be."""

from __future__ import annotations

import socket
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from typing import NamedTuple, Self

from tests.talking import DEADLINE_S

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


def request(message_id: int, tag: str, *reals: float, **integers: int) -> bytes:
    """A message with child elements: reals from R0 on, and integers by their names."""
    root = ET.Element("Cmd")
    values: dict[str, float] = {"I0": message_id, "I1": IDS[tag], **integers}
    values |= {f"R{place}": value for place, value in enumerate(reals)}
    for name, value in values.items():
        ET.SubElement(root, name).text = repr(value)
    return ET.tostring(root)


def in_attributes(values: Mapping[str, object]) -> bytes:
    return ET.tostring(ET.Element("Cmd", {name: str(value) for name, value in values.items()}))


def replies(wire: bytes) -> list[Reply]:
    """What stands in the bytes, which must be whole replies and nothing else."""
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
        """The next one."""
        (reply,) = replies(self.reply_bytes())
        return reply

    def reply_bytes(self) -> bytes:
        """The next one as it comes: it ends where its root does."""
        wire = b""
        while not wire.endswith(b"</Res>"):
            came = self._socket.recv(1)
            assert came, "the connection ended"
            wire += came
        return wire

    def rest(self) -> bytes:
        """All that still comes, up to the end of the connection."""
        wire = b""
        while came := self._socket.recv(4096):
            wire += came
        return wire

    def until(self, condition: Callable[[], bool]) -> None:
        """Asks again and again."""
        for _ in range(100_000):
            if condition():
                return
        raise AssertionError("never")

    def until_idle(self) -> None:
        self.until(lambda: self.ask("FIN").integers[2] == 1)
