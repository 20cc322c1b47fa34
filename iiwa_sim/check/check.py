"""Runs all probes and dialogues against one server and reports."""

from collections.abc import Iterator
from functools import partial

from iiwa_sim.check import motion, probes
from iiwa_sim.check.link import (
    COMMANDS,
    HARMLESS,
    NONSENSE,
    Finding,
    Link,
    Probe,
    Verdict,
    commands_of,
    deviates,
    same_unless,
    untried,
)
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.transcript.lines import Transcript, shipped
from iiwa_sim.transcript.replay import replay
from iiwa_sim.transcript.texts import TranscriptFault
from iiwa_sim.wording import harmless, shortened

ALLOW = "--allow-motion tries it"
LONGEST_SEEN = 600
"""Most characters of an observation in the report."""
HEAD = "The server beside the original one, as far as that is known, and beside iiwa-sim:"


def check(link: Link) -> Iterator[tuple[Probe, Finding]]:
    """Ask a server, and yield the findings.

    Raises TranscriptFault if the server is none, has gone meanwhile, or if its robot moves.
    """
    _greet(link)
    dialogues = [each for each in shipped() if not each.robot]
    dialogues.sort(key=lambda each: "bye" in each.commands)  # it may end the server, so it comes last
    for probe in (*probes.PROBES, *motion.PROBES, *map(_dialogue, dialogues), probes.BYE):
        yield probe, _find(link, probe)


def line(probe: Probe, finding: Finding) -> str:
    """Return the line of a report on one finding: behaviour, and what was expected if that differs."""
    told = f"{finding.verdict.value:15}  {probe.event}"
    seen = shortened(harmless(finding.seen), LONGEST_SEEN)
    match finding.verdict:
        case Verdict.ORIGINAL:
            told += f": {probe.original}" if probe.original else ""
        case Verdict.OURS:
            told += f": {probe.ours}; the original: {probe.original}"
        case Verdict.DEVIATION:
            other = f" (the original: {probe.original}" if probe.original else ""
            other += f"; iiwa-sim: {probe.ours}" if probe.ours else ""
            return f"{told}: {seen}{other}{')' if other else ''}"
    return f"{told} ({seen})" if seen else told


def summary(findings: list[Finding]) -> str:
    """Return the number of deviations, and of other findings."""
    count = {verdict: sum(each.verdict is verdict for each in findings) for verdict in Verdict}
    deviations = count[Verdict.DEVIATION]
    return (
        f"{deviations} deviation{'' if deviations == 1 else 's'}; {count[Verdict.ORIGINAL]} as the original, "
        f"{count[Verdict.OURS]} as iiwa-sim, {count[Verdict.UNTRIED]} not tried"
    )


def _greet(link: Link) -> None:
    where = host_and_port(link.host, link.port)
    try:
        with link.talk() as talk:
            reply = talk.ask("hello")
            if reply != "hello":
                raise OSError(f"it answers '{reply}' to 'hello'")
            status = talk.ask("get status")
    except OSError as fault:
        raise TranscriptFault(f"{where} is not a server of this protocol: {fault}") from None
    if status != "stopped":
        raise TranscriptFault(
            f"the robot at {where} says '{status}', expected 'stopped': clients that come and go may stop it"
        )


def _find(link: Link, probe: Probe) -> Finding:
    if probe.moves and not link.allow_motion:
        return untried(ALLOW)
    try:
        return probe.ask(link)
    except OSError as fault:
        return deviates(str(fault))
    except TranscriptFault as fault:
        raise TranscriptFault(f"the server has gone, at '{probe.event}': {fault}") from None


def _dialogue(transcript: Transcript) -> Probe:
    moves = not (HARMLESS | NONSENSE).issuperset(commands_of(transcript))
    return Probe(f"the dialogue {transcript.name}", "", partial(_play, transcript), moves=moves)


def _play(transcript: Transcript, link: Link) -> Finding:
    for each in sorted(transcript.commands & HARMLESS):
        if COMMANDS[each].extension and not link.knows(each):
            return untried(f"the server does not know the extension '{each}'")
    played = replay(transcript, link.host, link.port, link.timeout_s)
    return same_unless([f"line {each.line}: {each}" for each in played])
