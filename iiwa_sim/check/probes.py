"""Probes of lines, numbers and connections; none of them moves the robot without permission."""

import re
import time

from iiwa_sim.check.link import OURS, SAME, Finding, Link, Probe, Talk, Verdict, deviates, untried
from iiwa_sim.transcript.texts import TranscriptFault

PIECE_S = 0.03
"""Seconds between two pieces of a line, so that they travel in separate packets."""

PIPELINED = 200

ONE_RECEIVE = 1024
"""Bytes that the public driver reads at once."""


def _one_write(link: Link) -> Finding:
    with link.talk() as talk:
        for _ in range(20):
            talk.send(b"hello\r\n")
            got = talk.connection.receive()
            if got == b"hello\r\n":
                continue
            while not got.endswith((b"\n", b"\r")) and len(got) < ONE_RECEIVE:
                more = talk.connection.receive()
                if not more:
                    return deviates(f"the connection ended after {got!r}")
                got += more
                if got == b"hello\r\n":
                    return deviates("a reply came in pieces: a driver that reads once gets the first of them")
            return deviates(f"hello was answered {got!r}: a driver that compares with 'hello\\r\\n' fails")
    return SAME


def _line_ends(link: Link) -> Finding:
    wrong = []
    for end in (b"\n", b"\r", b"\r\n", b"\n\r"):
        with link.talk() as talk:
            talk.send(b"hello" + end)
            shown = repr(end)[2:-1]
            try:
                reply = talk.reply()
            except OSError as fault:
                wrong.append(f"{fault} to a line that ends with {shown}")
                continue
            if reply != "hello":
                wrong.append(f"'hello' with {shown} was answered '{reply}'")
            elif not talk.is_in_step():
                wrong.append(f"{shown} counts as more than one line end: replies fall out of step")
    return deviates("; ".join(wrong)) if wrong else SAME


def _split_lines(link: Link) -> Finding:
    with link.talk() as talk:
        for piece in (b"get s", b"tat", b"us\r", b"\n"):
            talk.send(piece)
            time.sleep(PIECE_S)
        reply = talk.reply()
        if reply not in ("moving", "stopped"):
            return deviates(f"'get status', sent in pieces, was answered '{reply}'")
        if not talk.is_in_step():
            return deviates("\\r\\n, its halves sent one after the other, counts as two line ends")
    return SAME


def _rest_without_end(link: Link) -> Finding:
    with link.talk() as talk:
        talk.send(b"hello")
        talk.connection.end_sending()
        reply = talk.reply()
    return SAME if reply == "hello" else deviates(f"it was answered '{reply}'")


def _empty_lines(link: Link) -> Finding:
    return _replies(link, dict.fromkeys(["", ":", "   "], "unknown command"))


def _case(link: Link) -> Finding:
    return _replies(link, {"HELLO": "hello", "Get Status": "stopped"})


def _blanks(link: Link) -> Finding:
    found = _replies(link, {"  hello": "hello", "get status \t": "stopped"})
    if found != SAME:
        return found
    with link.talk() as talk:
        between = {talk.ask(line) for line in ("get  status", "get\tstatus")}
    if between == {"unknown command"}:
        return SAME
    return OURS if between == {"stopped"} else deviates(f"blanks between words: {_listed(between)}")


def _two_colons(link: Link) -> Finding:
    return _replies(link, {"hello : :": "unknown command", "get status : 1 : 2": "unknown command"})


def _idle_parameters(link: Link) -> Finding:
    return _replies(link, {"get status : ": "stopped", "hello :x": "hello", "hello : 1 2": "hello"})


def _unknown(link: Link) -> Finding:
    return _replies(link, dict.fromkeys(["no such command", "get", "get status now"], "unknown command"))


def _pipelined(link: Link) -> Finding:
    with link.talk() as talk:
        talk.send(b"hello\r\nget status\r\n" * PIPELINED)
        replies = [talk.reply() for _ in range(2 * PIPELINED)]
    if replies == ["hello", "stopped"] * PIPELINED:
        return SAME
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
            except OSError as fault:
                wrong.append(f"{fault} to '{line}', which leaves a driver waiting")
                continue
            if reply != wanted:
                wrong.append(f"'{line}' was answered '{reply}'")
            elif not talk.is_in_step():
                wrong.append(f"'{line}' was answered twice: replies fall out of step")
    return deviates("; ".join(wrong)) if wrong else SAME


def _listed(words: set[str]) -> str:
    return ", ".join(f"'{word}'" for word in sorted(words))


TAKEN = ("1", "1.", "+.5", "1e1", "1E-5")
NOT_TAKEN = ("1_0", "1,5", "0x10", "one")
NOT_FINITE = ("NaN", "Infinity")

_WAY = "is reachable"
_PLAIN = re.compile(r"-?\d+\.\d+")
_JAVA = re.compile(r"-?\d+\.\d+(E-?\d+)?")
_STATUS = (
    "get joint position",
    "get tool frame",
    "get flange frame",
    "get joint torque",
    "get cartesian force",
)
_NEEDS_MOTION = "every command with parameters moves this server's robot: --allow-motion tries it"


def _too_few(link: Link) -> Finding:
    return _all_refused(link, ["1 2 3", "a b c d e f" if link.knows(_WAY) else "a b c d e f 0.05 0"])


def _too_many(link: Link) -> Finding:
    accepted = _accepted(link, ["{frame} 0.05 0 0 0" if not link.knows(_WAY) else "{frame} 0 0 0"])
    if accepted is None:
        return untried(_NEEDS_MOTION)
    return SAME if accepted == [True] else OURS


def _not_finite(link: Link) -> Finding:
    accepted = _accepted(link, [_with(link, word) for word in NOT_FINITE])
    if accepted is None:
        return untried(_NEEDS_MOTION)
    return SAME if all(accepted) else OURS if not any(accepted) else deviates("one of them is, one not")


def _spellings(link: Link) -> Finding:
    accepted = _accepted(link, [_with(link, word) for word in (*TAKEN, *NOT_TAKEN)])
    if accepted is None:
        return untried(_NEEDS_MOTION)
    taken = dict(zip((*TAKEN, *NOT_TAKEN), accepted, strict=True))
    wrong = [f"'{word}' is refused" for word in TAKEN if not taken[word]]
    wrong += [f"'{word}' is taken" for word in NOT_TAKEN if taken[word]]
    return deviates("; ".join(wrong)) if wrong else SAME


def _in_replies(link: Link) -> Finding:
    with link.talk() as talk:
        words = [word for command in _STATUS for word in talk.ask(command).split()]
    for word in words:
        if not _JAVA.fullmatch(word):
            return deviates(f"'{word}' in a reply: not every driver reads that")
    as_we_do = all(_PLAIN.fullmatch(word) and word != "-0.0" for word in words)
    return OURS if as_we_do else SAME


def _all_refused(link: Link, parameters: list[str]) -> Finding:
    accepted = _accepted(link, parameters)
    if accepted is None:
        return untried(_NEEDS_MOTION)
    wrong = [each for each, taken in zip(parameters, accepted, strict=True) if taken]
    return deviates(f"accepted: {'; '.join(wrong)}") if wrong else SAME


def _with(link: Link, word: str) -> str:
    """The parameters of a move, with this text in place of the number that can do the least harm."""
    return f"{{frame}} 0.05 {word}" if not link.knows(_WAY) else f"{word} 0 500 0 0 0"


def _accepted(link: Link, parameters: list[str]) -> list[bool] | None:
    """Which of these parameters the server accepts; None if that cannot be found out.

    `is reachable` tells without a move. Without it, moves to the present position are sent.
    """
    if not link.knows(_WAY) and not link.allow_motion:
        return None
    command = _WAY if link.knows(_WAY) else "ptp move"
    with link.talk() as talk:
        frame = " ".join(f"{value:.6f}" for value in talk.numbers("get tool frame"))
        replies = [talk.ask(f"{command} : {each.format(frame=frame)}") for each in parameters]
        if command != _WAY:
            _rest(talk)
    return [reply != "error" for reply in replies]


def _rest(talk: Talk) -> None:
    talk.ask("stop")
    time.sleep(0.2)


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
                    second.reply(link.timeout_s / 2)
                except OSError:
                    first.connection.close()
                    second.reply()
                    return SAME
                return OURS if first.is_in_step() else deviates("the first client is not answered any more")
        except (OSError, TranscriptFault) as fault:
            return deviates(f"the second client is never served: {fault}")


def _next_client(link: Link) -> Finding:
    with link.talk() as first:
        first.is_in_step()
    left = time.monotonic()
    with link.talk() as second:
        second.send(b"hello\r\n")
        second.reply()
    pause_s = time.monotonic() - left
    seen = f"after {pause_s:.1f} s"
    return Finding(Verdict.OURS if pause_s < AT_ONCE_S else Verdict.ORIGINAL, seen)


def _bye(link: Link) -> Finding:
    try:
        with link.talk() as talk:
            reply = talk.ask("bye")
            if reply != "bye":
                return deviates(f"it was answered '{reply}'")
            try:
                if talk.connection.receive():
                    return deviates("more came behind it")
            except OSError as fault:
                if "within" in str(fault):
                    return deviates("the connection stays open")
        with link.talk() as talk:
            return SAME if talk.is_in_step() else deviates("the next client is not answered")
    except TranscriptFault:
        return Finding(Verdict.OURS, "nobody listens any more")


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
    Probe("too few parameters, or words for numbers", "`error`", "", _too_few),
    Probe(
        "too many parameters",
        "those beyond are ignored",
        "the same, with a warning in the log; with --strict `error`",
        _too_many,
    ),
    Probe("`NaN`, `Infinity` as a parameter", "are taken", "`error`", _not_finite),
    Probe(
        "numbers as Java writes them: 1, 1., +.5, 1e1, 1E-5",
        "are taken, and 1_0, 1,5, 0x10 are not",
        "",
        _spellings,
    ),
    Probe(
        "numbers in replies",
        "as Java writes a double, also `1.0E-5` and `-0.0`",
        "with a point, never with an exponent, never `-0.0`",
        _in_replies,
    ),
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
