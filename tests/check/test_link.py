"""The guard: without leave to move the robot, nothing passes that could."""

from __future__ import annotations

import contextlib

import pytest

from iiwa_sim.check.link import COMMANDS, HARMLESS, NotAllowed, Talk


class Deaf:
    """Remembers what it is sent."""

    def __init__(self) -> None:
        self.sent = b""

    def send(self, data: bytes) -> None:
        self.sent += data


@pytest.mark.parametrize("before", [b"", b"hello\r\n", b"get status\n", b"\r"])
@pytest.mark.parametrize("rest", [b" : 1 2 3\r\n", b"\n", b": {get joint position}\r", b"\rhello\r\n"])
def test_no_command_that_moves_gets_through(before: bytes, rest: bytes) -> None:
    for name in COMMANDS:
        if name in HARMLESS:
            continue
        data = before + b"\t".join(name.upper().encode().split()) + rest
        for cut in range(len(data)):
            wire = Deaf()
            guarded = Talk(wire, allow_motion=False)
            with contextlib.suppress(NotAllowed):
                guarded.send(data[:cut])
                guarded.send(data[cut:])
            assert len(wire.sent) < len(before) + len(name)
