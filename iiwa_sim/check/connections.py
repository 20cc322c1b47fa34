"""Probes of connections: simultaneous clients, successive clients, and bye."""

import time

from iiwa_sim.check.findings import Finding, Probe, deviates, ours, same
from iiwa_sim.check.link import Link
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.wire import NoReply

AT_ONCE_S = 0.5
"""Seconds within which an immediate reply comes."""


def _second_client(link: Link) -> Finding:
    with link.talk() as first:
        if not first.is_in_step():
            return deviates("the first client is not answered")
        try:
            with link.talk() as second:
                second.send(b"hello\r\n")
                try:
                    second.wire.reply(link.timeout_s / 2)
                except NoReply:
                    first.wire.close()
                    second.wire.reply()
                    return same()
                return ours() if first.is_in_step() else deviates("the first client is not answered any more")
        except (NoReply, TranscriptFault) as fault:
            return deviates(f"the second client is never served: {fault}")


def _next_client(link: Link) -> Finding:
    with link.talk() as first:
        first.is_in_step()
    left = time.monotonic()
    with link.talk() as second:
        second.send(b"hello\r\n")
        second.wire.reply()
    pause_s = time.monotonic() - left
    seen = f"after {pause_s:.1f} s"
    return ours(seen) if pause_s < AT_ONCE_S else same(seen)


def _bye(link: Link) -> Finding:
    try:
        with link.talk() as talk:
            reply = talk.ask("bye")
            if reply != "bye":
                return deviates(f"it was answered '{reply}'")
            try:
                if talk.wire.receive():
                    return deviates("more came behind it")
            except NoReply as fault:
                if "within" in str(fault):
                    return deviates("the connection stays open")
        with link.talk() as talk:
            return same() if talk.is_in_step() else deviates("the next client is not answered")
    except TranscriptFault:
        return ours("nobody listens any more")


PROBES = (
    Probe(
        "a second client",
        "waits until the first has gone",
        "is served at the same time; --exclusive for the original's way",
        _second_client,
    ),
    Probe(
        "a client that comes when another has gone",
        "is served a second later",
        "is served at once; --reconnect-pause 1 for the original's way",
        _next_client,
    ),
)

BYE = Probe(
    "bye",
    "`bye`, the connection closes, the server serves on",
    'the same; with --bye-shuts-down the server ends, as Appendix B\'s "Driver Shutdown" says',
    _bye,
)
"""The last probes, as they may end the server."""
