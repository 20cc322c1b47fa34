"""Commands over one socket, pipelined and split at random, some of them rubbish."""

from __future__ import annotations

import logging
import random
import re
import socket
import threading
from collections.abc import Iterator

import pytest

from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S

BLOCK = 5000
"""Commands between two moves."""

NUMBERS = re.compile(rb"(-?\d+\.\d+ ){5,6}-?\d+\.\d+")
CONVERSATION: list[tuple[bytes, bytes]] = [  # a line, and what its reply must be
    (b"hello", rb"hello"),
    (b"HELLO : ignored", rb"hello"),
    (b"get  joint\tposition", NUMBERS.pattern),
    (b"get tool frame", NUMBERS.pattern),
    (b"get flange frame : ", NUMBERS.pattern),
    (b"get joint torque", NUMBERS.pattern),
    (b"get cartesian force", NUMBERS.pattern),
    (b"get status : ", rb"(moving|stopped)"),
    (b"stop", rb"done"),
    (b"help : lin move", rb"lin move : .*"),
    (b"lin move : 1 2 3", rb"error"),
    (b"ptp move : 600 0 nan 0 0 0 1 0", rb"error"),
    (b"joint move : 9 0 0 0 0 0 0 1 1 1 1 1 1 1", rb"error"),
    (b"help : nothing of the kind", rb"error"),
    (b"x" * 5000, rb"error"),
    (b" ", rb"unknown command"),
    (b":", rb"unknown command"),
    (b"hello : a : b", rb"unknown command"),
    (b"hello there", rb"unknown command"),
    (b"\x80\xfe \x1b[2J\xc3\xa4", rb"unknown command"),
    (b"hel\xff\xfb\x18lo", rb"hello"),  # telnet's negotiation in the middle
]
RARE = (b"x" * 5000, b"help : lin move")
WEIGHTS = [1 if line in RARE else 100 for line, _ in CONVERSATION]
MOVE = (b"joint move : 0.1 0.5 0 -1 0 1.5 0 1 1 1 1 1 1 1", rb"done")
ENDS = (b"\n", b"\r", b"\r\n", b"\n\r")


def blocks(seed: int, count: int) -> Iterator[list[tuple[bytes, bytes]]]:
    """The conversation, block by block; each holds one move, carried out while the rest is answered."""
    dice = random.Random(seed)
    for _ in range(count):
        yield [*dice.choices(CONVERSATION, WEIGHTS, k=BLOCK - 1), MOVE]


def send_all(connection: socket.socket, seed: int, count: int) -> None:
    dice = random.Random(seed + 1)
    for block in blocks(seed, count):
        data = memoryview(b"".join([line + dice.choice(ENDS) for line, _ in block]))
        while data:
            cut = dice.choice([1, 3, 50, 1400, 20_000, 200_000])
            connection.sendall(data[:cut])
            data = data[cut:]


@pytest.mark.requirement("FRA003", "FRA004", "FRA101")
@pytest.mark.parametrize("commands", [10_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_each_command_has_one_reply_in_order(commands: int) -> None:
    seed, count = 20, commands // BLOCK
    received = 0
    logging.getLogger("iiwa_sim").setLevel(logging.ERROR)
    with Simulator() as simulator:
        connection = socket.create_connection(("127.0.0.1", simulator.port), DEADLINE_S)
        with connection, connection.makefile("rb") as replies:
            sending = threading.Thread(target=send_all, args=(connection, seed, count))
            sending.start()
            for block in blocks(seed, count):
                for line, expected in block:
                    reply = replies.readline()
                    assert reply.endswith(b"\r\n")
                    assert re.fullmatch(expected, reply[:-2]), (received, line, reply)
                    received += 1
            sending.join()
            connection.sendall(b"bye")
            connection.shutdown(socket.SHUT_WR)
            assert replies.read() == b"bye\r\n", "no reply too many"
    assert received == commands
