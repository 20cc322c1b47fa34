"""Checks of servers: the simulator, one like the original, and others with one deviation each."""

from __future__ import annotations

import asyncio

import pytest

from iiwa_sim.check.check import COMMANDS, HARMLESS, check
from iiwa_sim.check.probes import Finding, Link, Verdict
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.texts import TranscriptFault, command_of
from tests.check import original
from tests.check.original import ConcurrentServer, OriginalServer, serving

BLANKS = "blanks and tabs between the words of a command"
ON_PURPOSE = {
    BLANKS,
    "`NaN`, `Infinity` as a parameter",
    "a second client",
}
"""Rows of the table of reference in which we do otherwise than the original, and can be seen to."""


def checked(link: Link) -> dict[str, Finding]:
    return {probe.event: finding for probe, finding in check(link)}


def found(findings: dict[str, Finding], verdict: Verdict) -> set[str]:
    return {event for event, finding in findings.items() if finding.verdict is verdict}


@pytest.mark.slow  # the robot moves in real time
async def test_the_simulator_deviates_only_where_intended(simulator: Simulator) -> None:
    link = Link("127.0.0.1", simulator.port, allow_motion=True, timeout_s=30)
    findings = await asyncio.to_thread(checked, link)
    assert found(findings, Verdict.DEVIATION) == set(), findings
    assert found(findings, Verdict.OURS) == ON_PURPOSE
    assert found(findings, Verdict.UNTRIED) == set()


async def test_without_permission_no_command_is_sent_that_could_move_a_robot(simulator: Simulator) -> None:
    texts: list[str] = []
    before = simulator.controller.joints
    simulator.dialogue.listeners.append(lambda line: texts.append(line.text) if line.mark == ">" else None)
    link = Link("127.0.0.1", simulator.port, allow_motion=False, timeout_s=30)
    findings = await asyncio.to_thread(checked, link)
    sent = {command_of(text.replace("\\t", " ")) for text in texts}
    assert sent & COMMANDS.keys() <= HARMLESS
    assert not {name for name in sent & set(COMMANDS) if COMMANDS[name].mode != "any"}
    moving = {f"the dialogue {name}.txt" for name in ("interrupted", "moves", "servo")}
    assert moving < found(findings, Verdict.UNTRIED)
    assert "the dialogue status.txt" in found(findings, Verdict.ORIGINAL)
    assert simulator.controller.joints == before


def test_the_original_has_no_deviations() -> None:
    with serving(OriginalServer) as server:
        findings = checked(Link("127.0.0.1", server.port, allow_motion=False, timeout_s=6))
    assert found(findings, Verdict.DEVIATION) == set()
    assert found(findings, Verdict.OURS) == set()
    received = {command_of(line) for line in server.received}
    assert received & COMMANDS.keys() <= HARMLESS
    assert "too many parameters" in found(findings, Verdict.UNTRIED)


@pytest.mark.parametrize(
    ("kind", "event", "words"),
    [
        (original.NewlineServer, "any reply", r"compares with 'hello\r\n'"),
        (original.CaseServer, "the dialogue lines.txt", "'HELLO': expected 'hello', got 'unknown command'"),
    ],
)
def test_a_deviation_is_reported_by_its_name(kind: type[ConcurrentServer], event: str, words: str) -> None:
    with serving(kind) as server:
        findings = checked(Link("127.0.0.1", server.port, allow_motion=False, timeout_s=30))
    assert found(findings, Verdict.DEVIATION) == {event}
    assert words in findings[event].seen


def test_a_robot_that_moves_is_left_alone() -> None:
    moves = pytest.raises(TranscriptFault, match=r"says .*'moving' to 'get status'")
    with serving(original.MovingServer) as server, moves:
        checked(Link("127.0.0.1", server.port, allow_motion=True))
    assert server.received == ["hello", "get status"]
