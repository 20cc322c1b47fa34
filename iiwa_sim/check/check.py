"""Runs all probes and dialogues against one server and reports."""

from collections import Counter
from collections.abc import Iterator
from functools import partial

from iiwa_sim.check.probes import PROBES, SAME, Finding, Link, Probe, Verdict, ask
from iiwa_sim.protocols.table import load_table
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.transcript.lines import Transcript, shipped
from iiwa_sim.transcript.replay import replay
from iiwa_sim.transcript.texts import TranscriptFault
from iiwa_sim.wording import harmless, shortened

LONGEST_SEEN = 600
"""Most characters of an observation in the report."""
HEAD = "The server beside the original one, as far as that is known, and beside iiwa-sim:"
COMMANDS = load_table("iiwa").commands
HARMLESS = frozenset(
    name for name in COMMANDS if name in ("hello", "help", "stop", "bye") or name.startswith(("get ", "is "))
)
"""Commands that change neither the robot's motion, nor its outputs, nor its errors."""


def check(link: Link) -> Iterator[tuple[Probe, Finding]]:
    """Ask a server, and yield the findings.

    Raises TranscriptFault if there is no server, if it disconnects, or if its robot moves.
    """
    _greet(link)
    dialogues = [each for each in shipped() if not each.robot]
    dialogues.sort(key=lambda each: "bye" in each.commands)  # it may end the server, so it comes last
    played = [Probe(f"the dialogue {each.name}", "", partial(_play, each)) for each in dialogues]
    for probe in (*PROBES, *played):
        try:
            found = probe.ask(link)
        except OSError as fault:
            found = str(fault)
        except TranscriptFault as fault:
            raise TranscriptFault(f"the server disconnected at '{probe.event}': {fault}") from None
        yield probe, Finding(Verdict.DEVIATION, found) if isinstance(found, str) else found


def line(probe: Probe, finding: Finding) -> str:
    """Return the line of a report on one finding: the observed behaviour, and the known one."""
    seen = shortened(harmless(finding.seen), LONGEST_SEEN)
    ours = f"; iiwa-sim: {probe.ours}" if probe.ours else ""
    known = f" (the original: {probe.original}{ours})" if probe.original else ""
    return f"{finding.verdict.value:15}  {probe.event}{seen and f': {seen}'}{known}"


def summary(findings: list[Finding]) -> str:
    """Return the number of findings of each verdict."""
    count = Counter(each.verdict for each in findings)
    return ", ".join(f"{count[verdict]} {verdict.value}" for verdict in Verdict)


def _greet(link: Link) -> None:
    where = host_and_port(link.host, link.port)
    try:
        with link.talk() as talk:
            reply, status = ask(talk, "hello"), ask(talk, "get status")
    except OSError as fault:
        raise TranscriptFault(f"{where} is not a server of this protocol: {fault}") from None
    if (reply, status) != ("hello", "stopped"):
        raise TranscriptFault(
            f"{where} says '{reply}' to 'hello', '{status}' to 'get status', expected 'hello' and 'stopped': "
            "clients that come and go may stop a robot"
        )


def _play(transcript: Transcript, link: Link) -> Finding | str:
    said = transcript.commands
    if not link.allow_motion and said & COMMANDS.keys() - HARMLESS:
        return Finding(Verdict.UNTRIED, "--allow-motion tries it")
    for each in sorted(said & HARMLESS):
        if COMMANDS[each].extension and not link.knows(each):
            return Finding(Verdict.UNTRIED, f"the server does not know the extension '{each}'")
    played = replay(transcript, link.host, link.port, link.timeout_s)
    return "; ".join(f"line {each.line}: {each}" for each in played) or SAME
