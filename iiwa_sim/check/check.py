"""Runs all probes and dialogues against one server and reports."""

from collections.abc import Iterator
from functools import partial

from iiwa_sim.check import connections, lines, motion, numbers
from iiwa_sim.check.findings import Finding, Probe, deviates, same, untried
from iiwa_sim.check.link import COMMANDS, HARMLESS, Link, commands_of, moves_nothing
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.transcript.fault import NoServer, TranscriptFault
from iiwa_sim.transcript.lines import Transcript, shipped
from iiwa_sim.transcript.replay import replay
from iiwa_sim.transcript.wire import NoReply

ALLOW = "--allow-motion tries it"


def check(link: Link) -> Iterator[tuple[Probe, Finding]]:
    """The findings, one after the other.

    Raises TranscriptFault if the server is none, has gone meanwhile, or if its robot moves.
    """
    _greet(link)
    dialogues = [each for each in shipped() if not each.robot]
    dialogues.sort(key=lambda each: "bye" in each.commands)  # it may end the server, so it comes last
    for probe in (
        *lines.PROBES,
        *numbers.PROBES,
        *connections.PROBES,
        *motion.PROBES,
        *map(_dialogue, dialogues),
        connections.BYE,
    ):
        yield probe, _find(link, probe)


def _greet(link: Link) -> None:
    where = host_and_port(link.host, link.port)
    try:
        with link.talk() as talk:
            if (reply := talk.ask("hello")) != "hello":
                raise TranscriptFault(f"{where} answers '{reply}' to 'hello': not a server of this protocol")
            status = talk.ask("get status")
    except NoReply as fault:
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
    except NoServer as fault:
        if not link.is_there():
            raise TranscriptFault(f"the server has gone, at '{probe.event}': {fault}") from None
        return deviates(str(fault))
    except (NoReply, TranscriptFault) as fault:
        return deviates(str(fault))


def _dialogue(transcript: Transcript) -> Probe:
    return Probe(
        f"the dialogue {transcript.name}",
        "",
        "",
        partial(_play, transcript),
        not moves_nothing(transcript),
    )


def _play(transcript: Transcript, link: Link) -> Finding:
    extensions = {each for each in transcript.commands & HARMLESS if COMMANDS[each].extension}
    if missing := sorted(each for each in extensions if not link.knows(each)):
        return untried(f"the server does not know the extension '{missing[0]}'")
    link.sent.update(commands_of(transcript))
    played = replay(transcript, link.host, link.port, link.timeout_s)
    wrong = [f"line {each.line}: {each}" for each in played]
    return deviates("; ".join(wrong)) if wrong else same()
