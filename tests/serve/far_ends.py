"""Both ends of a connection, and somebody to ask about them."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from iiwa_sim.serve.far_end import FarEnds, far_end
from tests.talking import DEADLINE_S


@contextmanager
def asking() -> Iterator[FarEnds]:
    far_ends = FarEnds()
    far_ends.open()
    try:
        yield far_ends
    finally:
        far_ends.close()


@contextmanager
def connected(
    family: int = socket.AF_INET, host: str = "127.0.0.1", *, both_families: bool = False
) -> Iterator[tuple[socket.socket, socket.socket]]:
    """Our end and the other one."""
    try:
        listening = socket.create_server(
            ("::" if both_families else host, 0),
            family=socket.AF_INET6 if both_families else family,
            dualstack_ipv6=both_families,
        )
    except OSError as fault:
        pytest.skip(f"no such addresses here: {fault}")
    with listening, socket.create_connection((host, listening.getsockname()[1]), DEADLINE_S) as theirs:
        listening.settimeout(DEADLINE_S)
        ours, _ = listening.accept()
        with ours:
            yield ours, theirs


def far_ends_are_told() -> bool:
    """Whether this system tells of them: a Linux that lets us ask."""
    with asking() as far_ends, connected() as (ours, _):
        end = far_end(ours)
        return end is not None and far_ends.has_read(end) is not None
