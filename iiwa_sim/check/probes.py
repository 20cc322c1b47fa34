"""Probes of lines, numbers and connections; none of them moves the robot without permission."""

import re
import time
from collections.abc import Callable
from itertools import product

from iiwa_sim.check.link import (
    NONSENSE,
    OURS,
    SAME,
    Finding,
    Link,
    Probe,
    Verdict,
    deviates,
    same_unless,
    untried,
)
from iiwa_sim.transcript.texts import TranscriptFault

PIECE_S = 0.03
"""Seconds between two pieces of a line, so that they travel in separate packets."""
PIPELINED = 200
AT_ONCE_S = 0.5
"""Seconds within which an immediate reply comes."""

_REACHABLE = "is reachable"
_PLAIN = re.compile(r"-?\d+\.\d+")
_JAVA = re.compile(r"-?\d+\.\d+(E-?\d+)?")


def _one_write(link: Link) -> Finding:
    with link.talk() as talk:
        for _ in range(20):
            talk.send(b"hello\r\n")
            got = talk.connection.receive()
            if got != b"hello\r\n":
                return deviates(
                    f"hello was answered {got!r}: a driver that compares with 'hello\\r\\n' fails"
                )
    return SAME


def _split_lines(link: Link) -> Finding:
    with link.talk() as talk:
        for piece in (b"get s", b"tat", b"us\r", b"\n"):
            talk.send(piece)
            time.sleep(PIECE_S)
        reply = talk.reply()
        if reply not in ("moving", "stopped"):
            return deviates(f"'get status', sent in pieces, was answered '{reply}'")
        in_step = talk.is_in_step()
    return (
        SAME if in_step else deviates("\\r\\n, its halves sent one after the other, counts as two line ends")
    )


def _rest_without_end(link: Link) -> Finding:
    with link.talk() as talk:
        talk.send(b"hello")
        talk.connection.end_sending()
        reply = talk.reply()
    return SAME if reply == "hello" else deviates(f"it was answered '{reply}'")


def _blanks(link: Link) -> Finding:
    found = _answers({"  hello": "hello", "get status \t": "stopped"})(link)
    if found != SAME:
        return found
    with link.talk() as talk:
        between = {talk.ask(line) for line in ("get  status", "get\tstatus")}
    if between == {"unknown command"}:
        return SAME
    return OURS if between == {"stopped"} else deviates(f"blanks between words: {sorted(between)}")


def _pipelined(link: Link) -> Finding:
    with link.talk() as talk:
        talk.send(b"hello\r\nget status\r\n" * PIPELINED)
        replies = [talk.reply() for _ in range(2 * PIPELINED)]
    for number, reply in enumerate(replies):
        if reply != ("hello", "stopped")[number % 2]:
            return deviates(f"reply {number + 1} of {2 * PIPELINED} is '{reply}': lines in a hurry get lost")
    return SAME


def _answers(expected: dict[str, str], ends: tuple[bytes, ...] = (b"\r\n",)) -> Callable[[Link], Finding]:
    """Check that each of these lines gets exactly one reply, the expected one, with each line end."""

    def ask(link: Link) -> Finding:
        wrong = []
        for (line, wanted), end in product(expected.items(), ends):
            shown = f"'{line}' with {repr(end)[2:-1]}"
            with link.talk() as talk:
                try:
                    talk.send(line.encode() + end)
                    reply = talk.reply()
                except OSError as fault:
                    wrong.append(f"{fault} to {shown}, which leaves a driver waiting")
                    continue
                if reply != wanted:
                    wrong.append(f"{shown} was answered '{reply}'")
                elif not talk.is_in_step():
                    wrong.append(f"{shown} was answered twice: replies fall out of step")
        return same_unless(wrong)

    return ask


def _unknown(*lines: str) -> Callable[[Link], Finding]:
    return _answers(dict.fromkeys(lines, "unknown command"))


def _takes(*taken: str, but: tuple[str, ...] = (), has_ours: bool = False) -> Callable[[Link], Finding]:
    """Check which parameters the server takes; `has_ours` if iiwa-sim does the opposite.

    `{start}` stands for the present place, with room for one more number. `is reachable` tells without a
    move. Without it, moves to the present place are sent.
    """

    def ask(link: Link) -> Finding:
        asks = link.knows(_REACHABLE)
        if not (asks or link.allow_motion):
            return untried("every command with parameters moves this server's robot: --allow-motion tries it")
        wrong = []
        with link.talk() as talk:
            start = " ".join(f"{value:.6f}" for value in talk.numbers("get tool frame"))
            for each in (*taken, *but):
                values = each.format(start=start if asks else f"{start} 0.05")
                is_taken = talk.ask(f"{_REACHABLE if asks else 'ptp move'} : {values}") != "error"
                if is_taken != (each in taken):
                    wrong.append(f"'{values}' is {'taken' if is_taken else 'refused'}")
            if not asks:
                talk.ask("stop")
                time.sleep(0.2)
        return OURS if has_ours and len(wrong) == len(taken) else same_unless(wrong)

    return ask


def _in_replies(link: Link) -> Finding:
    asked = ("joint position", "tool frame", "flange frame", "joint torque", "cartesian force")
    with link.talk() as talk:
        words = [word for name in asked for word in talk.ask(f"get {name}").split()]
    for word in words:
        if not _JAVA.fullmatch(word):
            return deviates(f"'{word}' in a reply: not every driver reads that")
    return OURS if all(_PLAIN.fullmatch(word) and word != "-0.0" for word in words) else SAME


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
        second.ask("hello")
    pause_s = time.monotonic() - left
    return Finding(Verdict.OURS if pause_s < AT_ONCE_S else Verdict.ORIGINAL, f"after {pause_s:.1f} s")


def _bye(link: Link) -> Finding:
    try:
        with link.talk() as talk:
            reply = talk.ask("bye")
            if reply != "bye":
                return deviates(f"it was answered '{reply}'")
            try:
                if talk.connection.receive():
                    return deviates("more came behind it")
            except TimeoutError:
                return deviates("the connection stays open")
            except OSError:
                pass
        with link.talk() as talk:
            return SAME if talk.is_in_step() else deviates("the next client is not answered")
    except TranscriptFault:
        return Finding(Verdict.OURS, "nobody listens any more")


_ONE_REPLY = "`unknown command`, one reply to each line"
_NUMBERS = tuple(f"{{start}} {word}" for word in ("1", "1.", "+.5", "1e1", "1E-5"))
_NO_NUMBERS = tuple(f"{{start}} {word}" for word in ("1_0", "1,5", "0x10", "one"))


_ENDS = _answers({"hello": "hello"}, ends=(b"\n", b"\r", b"\r\n", b"\n\r"))
_CASE = _answers({"HELLO": "hello", "Get Status": "stopped"})
_IDLE = _answers({"get status : ": "stopped", "hello :x": "hello", "hello : 1 2": "hello"})
PROBES = (
    Probe("any reply", "text and \\r\\n, in one write", _one_write),
    Probe("a line that ends with \\n, \\r, \\r\\n or \\n\\r", "each is one line end", _ENDS),
    Probe("a line that comes in pieces", "it counts when its end has come", _split_lines),
    Probe("a rest without a line end, at the end of the stream", "it is answered", _rest_without_end),
    Probe("an empty line, `:`, only blanks", _ONE_REPLY, _unknown("", ":", "   ")),
    Probe("a command that does not exist", _ONE_REPLY, _unknown(*sorted(NONSENSE - {""}))),
    Probe("capital and small letters", "count for the same", _CASE),
    Probe(
        "blanks and tabs round a command and between its words",
        "are ignored at the ends only",
        _blanks,
        "any run of them counts as one, as Appendix B says",
    ),
    Probe("more than one colon", "`unknown command`", _unknown("hello : :", "get status : 1 : 2")),
    Probe("parameters behind a command that takes none", "are ignored", _IDLE),
    Probe("hundreds of lines at once", "are answered one by one, in their order", _pipelined),
    Probe("stop, at rest", "`done`", _answers({"stop": "done"})),
    Probe(
        "too few parameters, or words for numbers",
        "`error`",
        _takes(but=("1 2 3", "a b c d e f 0.05 0")),
    ),
    Probe(
        "too many parameters",
        "those beyond are ignored",
        _takes("{start} 0 0 0", has_ours=True),
        "the same, with a warning in the log; with --strict `error`",
    ),
    Probe(
        "`NaN`, `Infinity` as a parameter",
        "are taken",
        _takes("{start} NaN", "{start} Infinity", has_ours=True),
        "`error`",
    ),
    Probe(
        "numbers as Java writes them: 1, 1., +.5, 1e1, 1E-5",
        "are taken, and 1_0, 1,5, 0x10 are not",
        _takes(*_NUMBERS, but=_NO_NUMBERS),
    ),
    Probe(
        "numbers in replies",
        "as Java writes a double, also `1.0E-5` and `-0.0`",
        _in_replies,
        "with a point, never with an exponent, never `-0.0`",
    ),
    Probe(
        "a second client",
        "waits until the first has gone",
        _second_client,
        "is served at the same time; --exclusive for the original's way",
    ),
    Probe(
        "a client that comes when another has gone",
        "is served a second later",
        _next_client,
        "is served at once; --reconnect-pause 1 for the original's way",
    ),
)

BYE = Probe(
    "bye",
    "`bye`, the connection closes, the server serves on",
    _bye,
    'the same; with --bye-shuts-down the server ends, as Appendix B\'s "Driver Shutdown" says',
)
"""The last probe, as it may end the server."""
