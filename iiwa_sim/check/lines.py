"""Probes of lines: their ends, their contents, and the replies."""

import time

from iiwa_sim.check.findings import Finding, Probe, deviates, ours, same
from iiwa_sim.check.link import Link
from iiwa_sim.transcript.wire import NoReply

PIECE_S = 0.03
"""Seconds between two pieces of a line, so that they travel in separate packets."""

PIPELINED = 200

ONE_RECEIVE = 1024
"""Bytes that the public driver reads at once."""


def _one_write(link: Link) -> Finding:
    with link.talk() as talk:
        for _ in range(20):
            talk.send(b"hello\r\n")
            got = talk.wire.receive()
            if got == b"hello\r\n":
                continue
            while not got.endswith((b"\n", b"\r")) and len(got) < ONE_RECEIVE:
                more = talk.wire.receive()
                if not more:
                    return deviates(f"the connection ended after {got!r}")
                got += more
                if got == b"hello\r\n":
                    return deviates("a reply came in pieces: a driver that reads once gets the first of them")
            return deviates(f"hello was answered {got!r}: a driver that compares with 'hello\\r\\n' fails")
    return same()


def _line_ends(link: Link) -> Finding:
    wrong = []
    for end in (b"\n", b"\r", b"\r\n", b"\n\r"):
        with link.talk() as talk:
            talk.send(b"hello" + end)
            shown = repr(end)[2:-1]
            try:
                reply = talk.wire.reply()
            except NoReply as fault:
                wrong.append(f"{fault} to a line that ends with {shown}")
                continue
            if reply != "hello":
                wrong.append(f"'hello' with {shown} was answered '{reply}'")
            elif not talk.is_in_step():
                wrong.append(f"{shown} counts as more than one line end: replies fall out of step")
    return deviates("; ".join(wrong)) if wrong else same()


def _split_lines(link: Link) -> Finding:
    with link.talk() as talk:
        for piece in (b"get s", b"tat", b"us\r", b"\n"):
            talk.send(piece)
            time.sleep(PIECE_S)
        reply = talk.wire.reply()
        if reply not in ("moving", "stopped"):
            return deviates(f"'get status', sent in pieces, was answered '{reply}'")
        if not talk.is_in_step():
            return deviates("\\r\\n, its halves sent one after the other, counts as two line ends")
    return same()


def _rest_without_end(link: Link) -> Finding:
    with link.talk() as talk:
        talk.send(b"hello")
        talk.wire.sends_no_more()
        reply = talk.wire.reply()
    return same() if reply == "hello" else deviates(f"it was answered '{reply}'")


def _empty_lines(link: Link) -> Finding:
    return _replies(link, dict.fromkeys(["", ":", "   "], "unknown command"))


def _case(link: Link) -> Finding:
    return _replies(link, {"HELLO": "hello", "Get Status": "stopped"})


def _blanks(link: Link) -> Finding:
    found = _replies(link, {"  hello": "hello", "get status \t": "stopped"})
    if found != same():
        return found
    with link.talk() as talk:
        between = {talk.ask(line) for line in ("get  status", "get\tstatus")}
    if between == {"unknown command"}:
        return same()
    return ours() if between == {"stopped"} else deviates(f"blanks between words: {_listed(between)}")


def _two_colons(link: Link) -> Finding:
    return _replies(link, {"hello : :": "unknown command", "get status : 1 : 2": "unknown command"})


def _idle_parameters(link: Link) -> Finding:
    return _replies(link, {"get status : ": "stopped", "hello :x": "hello", "hello : 1 2": "hello"})


def _unknown(link: Link) -> Finding:
    return _replies(link, dict.fromkeys(["no such command", "get", "get status now"], "unknown command"))


def _pipelined(link: Link) -> Finding:
    with link.talk() as talk:
        talk.send(b"hello\r\nget status\r\n" * PIPELINED)
        replies = [talk.wire.reply() for _ in range(2 * PIPELINED)]
    if replies == ["hello", "stopped"] * PIPELINED:
        return same()
    wrong = next(n for n, reply in enumerate(replies) if reply != ("hello", "stopped")[n % 2])
    return deviates(f"reply {wrong + 1} of {2 * PIPELINED} is '{replies[wrong]}': lines in a hurry get lost")


def _stop_at_rest(link: Link) -> Finding:
    return _replies(link, {"stop": "done"})


def _replies(link: Link, expected: dict[str, str]) -> Finding:
    """Check that each of these lines gets exactly one reply, the expected one."""
    wrong = []
    for line, wanted in expected.items():
        with link.talk() as talk:
            try:
                reply = talk.ask(line)
            except NoReply as fault:
                wrong.append(f"{fault} to '{line}', which leaves a driver waiting")
                continue
            if reply != wanted:
                wrong.append(f"'{line}' was answered '{reply}'")
            elif not talk.is_in_step():
                wrong.append(f"'{line}' was answered twice: replies fall out of step")
    return deviates("; ".join(wrong)) if wrong else same()


def _listed(words: set[str]) -> str:
    return ", ".join(f"'{word}'" for word in sorted(words))


ONE_REPLY = "`unknown command`, one reply to each line"

PROBES = (
    Probe("any reply", "text and \\r\\n, in one write", "", _one_write),
    Probe("a line that ends with \\n, \\r, \\r\\n or \\n\\r", "each is one line end", "", _line_ends),
    Probe("a line that comes in pieces", "it counts when its end has come", "", _split_lines),
    Probe("a rest without a line end, at the end of the stream", "it is answered", "", _rest_without_end),
    Probe("an empty line, `:`, only blanks", ONE_REPLY, "", _empty_lines),
    Probe("a command that does not exist", ONE_REPLY, "", _unknown),
    Probe("capital and small letters", "count for the same", "", _case),
    Probe(
        "blanks and tabs round a command and between its words",
        "are ignored at the ends only",
        "any run of them counts as one, as Appendix B says",
        _blanks,
    ),
    Probe("more than one colon", "`unknown command`", "", _two_colons),
    Probe("parameters behind a command that takes none", "are ignored", "", _idle_parameters),
    Probe("hundreds of lines at once", "are answered one by one, in their order", "", _pipelined),
    Probe("stop, at rest", "`done`", "", _stop_at_rest),
)
