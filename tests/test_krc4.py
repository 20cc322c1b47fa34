"""KRC4 messages over a real socket: a process of its own, and a client of the standard library."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from iiwa_sim.protocols.krc4_xml import MESSAGES
from iiwa_sim.robot.description import RobotFault
from iiwa_sim.simulator import Simulator
from tests.krc4_client import IDS, Krc4Client, attributes, replies, request
from tests.processes import refused


@pytest.fixture(scope="module")
def simulator() -> Iterator[Simulator]:
    with Simulator("kr_6_r900_sixx", protocol=["krc4"]) as simulator:
        yield simulator


@pytest.mark.requirement("FRA101")
def test_messages_come_in_any_packets_and_a_half_closed_client_gets_its_replies(simulator: Simulator) -> None:
    with Krc4Client(simulator.port) as client:
        client.send(b"".join(attributes("Cmd", {"I0": number, "I1": 100}) for number in range(200)))
        for byte in request(200, "GOP"):
            client.send(bytes([byte]))
        client.send(request(201, "GOA") + b"<Cmd>")
        client.sends_no_more()
        found = replies(client.rest())
    assert [reply.id for reply in found[:-1]] == list(range(202))
    assert [reply.integers[:3] for reply in found[-2:]] == [(201, 320, 0), (0, 0, 3040)]


def test_the_text_protocol_is_rejected_for_six_axes() -> None:
    line = refused("--robot", "kr_6_r900_sixx")
    expected = (
        "7 joints for protocol iiwa; for 6 there is: --protocol krc4, or protocol = 'krc4' in a [[robot]]\n"
    )
    assert line.endswith(expected)
    with pytest.raises(RobotFault, match="for protocol iiwa"):
        Simulator("kr_6_r900_sixx", protocol=["krc4", "iiwa"])


def test_the_table_holds_appendix_c() -> None:
    assert {tag: row["id"] for tag, row in MESSAGES.items()} == IDS
    frame = ["R0", "R1", "R2", "R3", "R4", "R5"]
    takes = {tag: list(row["inputs"]) for tag, row in MESSAGES.items() if "inputs" in row}
    assert takes == {"LIN": frame, "PTP": frame, "SIO": ["I2", "I3"], "GIO": ["I2"]}
    gives = {tag: list(row["outputs"]) for tag, row in MESSAGES.items() if "outputs" in row}
    assert gives == {"FIN": ["I2"], "GIO": ["I3"], "DIS": ["R0"], "GOP": frame}
    joints = {tag: row["joints"] for tag, row in MESSAGES.items() if "joints" in row}
    assert joints == {"LIA": "input", "PTA": "input", "GOA": "output"}
    assert all(row["requirements"] and row["summary"] for row in MESSAGES.values())
