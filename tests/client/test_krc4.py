"""The client `Krc4` at a real simulator."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from iiwa_sim.client import Krc4, Krc4Error, ReplyError
from iiwa_sim.simulator import Simulator
from tests.krc4_client import FULL, elements
from tests.line_client import DEADLINE_S

JOINTS_DEG = (0, -90, 90, 0, 90, 0)


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator("kr_6_r900_sixx", protocol=["krc4"], clock="fast") as simulator:
        yield simulator


@pytest.fixture
def robot(simulator: Simulator) -> Iterator[Krc4]:
    with Krc4(simulator.host, simulator.port, DEADLINE_S) as robot:
        yield robot


@contextmanager
def answering(answer: Callable[[bytes], bytes]) -> Iterator[Krc4]:
    """A client of a peer that answers one message."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.sendall(answer(connection.recv(65536)))
                connection.recv(65536)

        peer = threading.Thread(target=serve)
        peer.start()
        with Krc4("127.0.0.1", listener.getsockname()[1], DEADLINE_S) as robot:
            yield robot
        peer.join(DEADLINE_S)


@pytest.mark.requirement("FRA005", "FRC004", "FRC005")
def test_every_message_has_a_method(robot: Krc4) -> None:
    robot.pta(JOINTS_DEG)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.fin()
    assert robot.goa() == pytest.approx(JOINTS_DEG, abs=1e-6)
    start = robot.gop()
    robot.lin(start._replace(z_mm=start.z_mm + 50))
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.gop().z_mm == pytest.approx(start.z_mm + 50)
    robot.ptp(start)
    robot.lia(JOINTS_DEG)
    robot.sto()
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.dis() == 0.0
    robot.sio(2, True)
    assert robot.gio(2) is True
    assert robot.gio(3) is False
    with pytest.raises(Krc4Error, match=r"the robot rejected LIN .* with error 3021") as rejected:
        robot.lin((5000, 0, 0, 0, 0, 0))
    assert rejected.value.code == 3021
    with pytest.raises(ValueError, match="expected 6 finite numbers"):
        robot.pta((0, 0))
    assert robot.fin()


@pytest.mark.parametrize(
    "reply",
    [
        b"<Res I0='1'/>",
        b"<Res><I0>1</I1></Res>",
        elements("Res", FULL | {"I0": "2", "I1": "100"}),
        elements("Res", FULL | {"I0": "1", "I1": "310"}),
        elements("Res", FULL | {"I0": "1", "I1": "100", "I2": "x"}),
    ],
)
def test_a_reply_that_does_not_fit_ends_the_connection(reply: bytes) -> None:
    with answering(lambda _: reply) as robot:
        with pytest.raises(ReplyError, match="FIN was answered"):
            robot.fin()
        with pytest.raises(ConnectionError, match="this connection is closed"):
            robot.fin()
