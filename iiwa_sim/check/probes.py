"""Probes of lines, numbers and connections; none of them moves the robot without permission.

`protocol/transcripts/lines.txt` has what a dialogue can tell.
"""

import time
from collections.abc import Callable

from iiwa_sim.check.link import Finding, Link, Probe, Talk, Verdict
from iiwa_sim.transcript.texts import TranscriptFault

PIECE_S = 0.03
"""Seconds between two pieces of a line, so that they travel in separate packets."""
PIPELINED = 200

_REACHABLE = "is reachable"
SAME, OURS = Finding(Verdict.ORIGINAL), Finding(Verdict.OURS)


def _one_write(link: Link) -> Finding | str:
    with link.talk() as talk:
        for _ in range(20):
            talk.send(b"hello\r\n")
            got = talk.connection.receive()
            if got != b"hello\r\n":
                return f"hello was answered {got!r}: a driver that compares with 'hello\\r\\n' fails"
    return SAME


def _line_ends(link: Link) -> Finding | str:
    for end in (b"\n", b"\r", b"\r\n", b"\n\r"):
        with link.talk() as talk:
            talk.send(b"get status" + end)
            if (reply := talk.reply()) != "stopped" or not _is_in_step(talk):
                return f"'get status' with {repr(end)[2:-1]} was answered '{reply}', or twice"
    return SAME


def _split_lines(link: Link) -> Finding | str:
    with link.talk() as talk:
        for piece in (b"get s", b"tat", b"us\r", b"\n"):
            talk.send(piece)
            time.sleep(PIECE_S)
        if (reply := talk.reply()) != "stopped":
            return f"'get status', sent in pieces, was answered '{reply}'"
        return SAME if _is_in_step(talk) else "\\r\\n, its halves sent one after the other, are two line ends"


def _blanks(link: Link) -> Finding | str:
    with link.talk() as talk:
        replies = {talk.ask(line) for line in ("get  status", "get\tstatus")}
    if replies == {"unknown command"}:
        return SAME
    return OURS if replies == {"stopped"} else f"blanks between words: {sorted(replies)}"


def _pipelined(link: Link) -> Finding | str:
    with link.talk() as talk:
        talk.send(b"hello\r\nget status\r\n" * PIPELINED)
        for number in range(2 * PIPELINED):
            if (reply := talk.reply()) != ("hello", "stopped")[number % 2]:
                return f"reply {number + 1} of {2 * PIPELINED} is '{reply}': lines in a hurry get lost"
    return SAME


def _takes(*taken: str, but: tuple[str, ...] = (), has_ours: bool = False) -> Callable[[Link], Finding | str]:
    """Check which parameters the server takes; `has_ours` if iiwa-sim does the opposite.

    `{start}` stands for the present place, with room for one more number. `is reachable` tells without a
    move. Without it, moves to the present place are sent.
    """

    def ask(link: Link) -> Finding | str:
        asks = link.knows(_REACHABLE)
        if not (asks or link.allow_motion):
            why = "every command with parameters moves this server's robot: --allow-motion tries it"
            return Finding(Verdict.UNTRIED, why)
        wrong = []
        with link.talk() as talk:
            start = talk.ask("get tool frame") + ("" if asks else " 0.05")
            for each in (*taken, *but):
                values = each.format(start=start)
                is_taken = talk.ask(f"{_REACHABLE if asks else 'ptp move'} : {values}") != "error"
                if is_taken != (each in taken):
                    wrong.append(f"'{values}' is {'taken' if is_taken else 'refused'}")
            if not asks:
                talk.ask("stop")
                time.sleep(0.2)
        if has_ours and len(wrong) == len(taken):
            return OURS
        return "; ".join(wrong) or SAME

    return ask


def _second_client(link: Link) -> Finding | str:
    with link.talk() as first:
        first.ask("hello")
        try:
            with link.talk() as second:
                second.send(b"hello\r\n")
                try:
                    second.reply(link.timeout_s / 2)
                except OSError:
                    first.connection.close()
                    second.reply()
                    return SAME
                return OURS if _is_in_step(first) else "the first client is not answered any more"
        except (OSError, TranscriptFault) as fault:
            return f"the second client is never served: {fault}"


def _is_in_step(talk: Talk) -> bool:
    """Return True if the next reply belongs to the next line."""
    try:
        return talk.ask("hello") == "hello"
    except OSError:
        return False


_NUMBERS = tuple(f"{{start}} {word}" for word in ("1", "1.", "+.5", "1e1", "1E-5"))
_NO_NUMBERS = tuple(f"{{start}} {word}" for word in ("1_0", "1,5", "0x10", "one"))

PROBES = (
    Probe("any reply", "text and \\r\\n, in one write", _one_write),
    Probe("a line that ends with \\n, \\r, \\r\\n or \\n\\r", "each is one line end", _line_ends),
    Probe("a line that comes in pieces", "it counts when its end has come", _split_lines),
    Probe(
        "blanks and tabs between the words of a command",
        "are not ignored",
        _blanks,
        "any run of them counts as one, as Appendix B says",
    ),
    Probe("hundreds of lines at once", "are answered one by one, in their order", _pipelined),
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
        "a second client",
        "waits until the first has gone",
        _second_client,
        "is served at the same time; --exclusive for the original's way",
    ),
)
