"""Probes of numbers: which spellings and counts are accepted, and how replies write them."""

import re
import time

from iiwa_sim.check.findings import Finding, Probe, deviates, ours, same, untried
from iiwa_sim.check.link import Link, Talk

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
    return same() if accepted == [True] else ours()


def _not_finite(link: Link) -> Finding:
    accepted = _accepted(link, [_with(link, word) for word in NOT_FINITE])
    if accepted is None:
        return untried(_NEEDS_MOTION)
    return same() if all(accepted) else ours() if not any(accepted) else deviates("one of them is, one not")


def _spellings(link: Link) -> Finding:
    accepted = _accepted(link, [_with(link, word) for word in (*TAKEN, *NOT_TAKEN)])
    if accepted is None:
        return untried(_NEEDS_MOTION)
    taken = dict(zip((*TAKEN, *NOT_TAKEN), accepted, strict=True))
    wrong = [f"'{word}' is refused" for word in TAKEN if not taken[word]]
    wrong += [f"'{word}' is taken" for word in NOT_TAKEN if taken[word]]
    return deviates("; ".join(wrong)) if wrong else same()


def _in_replies(link: Link) -> Finding:
    with link.talk() as talk:
        words = [word for command in _STATUS for word in talk.ask(command).split()]
    for word in words:
        if not _JAVA.fullmatch(word):
            return deviates(f"'{word}' in a reply: not every driver reads that")
    as_we_do = all(_PLAIN.fullmatch(word) and word != "-0.0" for word in words)
    return ours() if as_we_do else same()


def _all_refused(link: Link, parameters: list[str]) -> Finding:
    accepted = _accepted(link, parameters)
    if accepted is None:
        return untried(_NEEDS_MOTION)
    wrong = [each for each, taken in zip(parameters, accepted, strict=True) if taken]
    return deviates(f"accepted: {'; '.join(wrong)}") if wrong else same()


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


PROBES = (
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
)
