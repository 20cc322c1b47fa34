"""Clients of both kinds, blocking and async, called alike, and peers that say what a test wants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.client.peers import Answer, Awaited, Peer

Open = Callable[..., Any]


@pytest.fixture(params=["blocking", "async"])
def open_client(request: pytest.FixtureRequest) -> Iterator[Open]:
    """Connects a client of one of the two KINDS of the test's module; no method needs await."""
    blocking, asynchronous = request.module.KINDS
    opened: list[Any] = []

    def open_client(port: int, **options: Any) -> Any:
        if request.param == "blocking":
            opened.append(blocking("127.0.0.1", port, 10.0, **options))
        else:
            opened.append(Awaited(lambda: asynchronous("127.0.0.1", port, 10.0, **options)))
            opened[-1].reconnect()
        return opened[-1]

    yield open_client
    for client in opened:
        client.let_go() if isinstance(client, Awaited) else client.close()


@pytest.fixture
def connect(open_client: Open) -> Iterator[Callable[[Answer], tuple[Any, Peer]]]:
    """A client, and the peer that it is connected to."""
    opened: list[tuple[Any, Peer]] = []

    def connect(answer: Answer) -> tuple[Any, Peer]:
        peer = Peer(answer)
        opened.append((open_client(peer.port), peer))
        return opened[-1]

    yield connect
    for client, peer in opened:
        client.close()
        peer.close()
