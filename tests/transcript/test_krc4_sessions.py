"""Sessions with KRC4 messages over sockets: recorded, played again, and servers that speak otherwise."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from iiwa_sim.protocols.krc4_xml import MAX_MESSAGE_BYTES
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Kind, Transcript, read_file
from iiwa_sim.transcript.replay import replay
from iiwa_sim.transcript.texts import TranscriptFault
from tests.krc4_client import IDS, Krc4Client, attributes, request
from tests.simulated_time import simulated_time

HOME_DEG = (0.0, -90.0, 90.0, 0.0, 90.0, 0.0)
BESIDE = (445.0, 20.0, 800.0, 170.0, 10.0, 170.0)
SIX_AXES = "kr_6_r900_sixx"


def played(transcript: Transcript, simulator: Simulator, timeout_s: float = 30.0) -> list[tuple[int, str]]:
    found = replay(
        transcript, simulator.host, list(simulator.ports.values()), timeout_s, simulated_time(simulator)
    )
    return [(each.line, str(each)) for each in found]


def talk(simulator: Simulator) -> None:
    """Every message, carried out and refused, and what is none, in the middle of moves too."""
    with Krc4Client(simulator.ports["krc4"]) as one, Krc4Client(simulator.ports["krc4"]) as other:
        for tag, values in {"PTA": HOME_DEG, "LIN": BESIDE, "LIA": HOME_DEG, "PTP": BESIDE}.items():
            one.ask(tag, *values)
            simulator.advance(0.1)
            for question in ("FIN", "DIS", "GOP", "GOA"):
                other.ask(question)
            simulator.run_until_stopped()
            one.ask("GOA")
        one.ask("PTA", 160.0, 40.0, -100.0, 0.0, 90.0, 0.0)
        simulator.advance(0.2)
        one.ask("STO")
        simulator.run_until_stopped()
        one.ask("GOP")
        one.ask("SIO", I2=5, I3=1)
        one.ask("GIO", I2=5)
        for tag in IDS:
            one.send(request(99, tag, X=1))
            one.reply()
        one.ask("PTP", 9999.0)
        for wire in (
            attributes("Cmd", {"I0": 7, "I1": 310}),
            b"<?xml version='1.0'?><!-- {GOA R0} --><Cmd>\n<I0> 8</I0><I1>\t320</I1></Cmd>",
            b"<Cmd I0='1' I1='100' R0='{GOP R0} \\ 1'/>",
            "<Cm\u00e4><I0>1</I0></Cm\u00e4>".encode(),
        ):
            one.send(wire)
            one.reply_bytes()
        other.sends_no_more()
        other.rest()
    for rubbish in (b"Cmd I0=1 I1=100", b"<Cmd>&x;</Cmd>", b"(no message)"):
        with Krc4Client(simulator.ports["krc4"]) as another:
            another.send(rubbish)
            another.rest()
    with Krc4Client(simulator.ports["krc4"]) as long_winded:
        long_winded.send(b"<" + b"a" * MAX_MESSAGE_BYTES)
        long_winded.reply_bytes()
    with Krc4Client(simulator.ports["krc4"]) as interrupted:
        interrupted.send(b"<Cmd><I0>1")
        interrupted.sends_no_more()
        interrupted.rest()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "session.txt"
    with Simulator(SIX_AXES, protocol=["krc4"], clock="stepped", transcript=path) as simulator:
        talk(simulator)
    return path


@pytest.mark.requirement("FRA004")
def test_a_session_with_every_message_is_recorded_and_played(recorded: Path) -> None:
    transcript = read_file(recorded)
    assert transcript.protocols == ("krc4",)
    assert set(IDS) <= transcript.commands
    by_mark = {step.kind for step in transcript.steps if step.kind.is_reply}
    assert by_mark == {Kind.EXACT, Kind.NUMBERS}
    with Simulator(SIX_AXES, protocol=["krc4"], clock="stepped") as another:
        assert played(transcript, another) == []


def test_both_protocols_of_one_robot_are_recorded_and_played(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    with (
        Simulator(protocol=["iiwa", "krc4"], clock="stepped", transcript=str(path)) as simulator,
        socket.create_connection((simulator.host, simulator.ports["iiwa"])) as driver,
        Krc4Client(simulator.ports["krc4"]) as plc,
        driver.makefile("rb") as replies,
    ):
        plc.ask("PTA", 5.0, 30.0, 0.0, -60.0, 0.0, 90.0, 10.0)
        for line in (b"get status", b"get goal joint position", b"\x01: {get mode}"):
            driver.sendall(line + b"\r\n")
            replies.readline()
        simulator.run_until_stopped()
        plc.ask("GOA")
    text = path.read_text()
    assert "\nprotocol iiwa,krc4\n" in text
    assert text.count(" connects in krc4\n") == 1
    assert text.count(" connects\n") == 1
    assert text.count(" leaves\n") == 2
    with Simulator(protocol=["iiwa", "krc4"], clock="stepped") as another:
        assert played(read_file(path), another) == []
    with (
        Simulator(clock="stepped") as one_protocol,
        pytest.raises(TranscriptFault, match="number of ports 1, expected one each for iiwa, krc4"),
    ):
        played(read_file(path), one_protocol)
