"""Probes that move the robot: A7 by at most 0.1 rad, the TCP by at most 40 mm upwards, slowly, and back."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from iiwa_sim.check.link import OURS, SAME, Finding, Link, Probe, Talk, deviates, untried

WAY_RAD = 0.1
SLOW = 0.02
UP_MM = 40.0
UP_SPEED = 0.05
LOOKS_S = 0.1
STILL_LOOKS = 3
"""Number of equal readings that show rest: a robot that reverses is still for a moment."""
REST_S = 20.0
AT_REST_RAD = 1e-4
"""Movement of the readings of a robot at rest."""


class _NotDone(Exception):
    """A motion command was not answered `done`; the message tells which, and what it was answered."""


def _done_is_not_arrived(talk: Talk, start: list[float], _: Link) -> Finding:
    _do(talk, _a7("joint move", start, SLOW))
    status = talk.ask("get status")
    return SAME if status == "moving" else deviates(f"`get status` behind it says '{status}'")


def _stop_forgets(talk: Talk, start: list[float], _: Link) -> Finding:
    _do(talk, _a7("joint move", start, SLOW))
    _do(talk, _a7("joint move", start, SLOW, -WAY_RAD))
    _do(talk, "stop")
    _highest_mm(talk)
    if _moves(talk):
        return deviates("the robot went on to the move that waited")
    way = abs(talk.numbers("get joint position")[6] - start[6])
    return SAME if way < WAY_RAD / 2 else deviates("the move was not stopped")


def _gone_client(talk: Talk, start: list[float], link: Link) -> Finding:
    talk.connection.close()
    with link.talk() as other:
        _do(other, _a7("joint move", start, SLOW))
    with link.talk() as other:
        _highest_mm(other)
        way = abs(other.numbers("get joint position")[6] - start[6])
    return SAME if way < 0.9 * WAY_RAD else deviates("the robot went on to its target")


def _malformed_move(talk: Talk, start: list[float], _: Link) -> Finding:
    _do(talk, _a7("smart joint move", start, SLOW))
    time.sleep(LOOKS_S)
    if (reply := talk.ask("lin move : 1")) != "error":
        return deviates(f"'lin move : 1' was answered '{reply}'")
    time.sleep(3 * LOOKS_S)
    return OURS if _moves(talk) else SAME


def _stiffness_move_replaces(talk: Talk, _start: list[float], _: Link) -> Finding:
    frame = talk.numbers("get tool frame")
    for way_mm in (UP_MM, 0.0):
        _do(talk, _upwards(frame, way_mm))
        time.sleep(3 * LOOKS_S)
    waits = _highest_mm(talk) - frame[2] > 0.9 * UP_MM
    return deviates("it waits until the one before is done") if waits else SAME


def _probe(
    event: str, original: str, body: Callable[[Talk, list[float], Link], Finding], ours: str = ""
) -> Probe:
    """A probe between two moments of rest at the same place."""

    def ask(link: Link) -> Finding:
        with _moved(link) as (talk, start):
            try:
                return body(talk, start, link)
            except _NotDone as fault:
                return untried(str(fault))

    return Probe(event, original, ask, ours, moves=True)


@contextmanager
def _moved(link: Link) -> Iterator[tuple[Talk, list[float]]]:
    """A connection and the robot's position; at the end the robot returns there."""
    with link.talk() as talk:
        start = talk.numbers("get joint position")
        try:
            yield talk, start
        finally:
            talk.connection.close()
            with link.talk() as other:
                other.ask("stop")
                _highest_mm(other)
                other.ask(_a7("joint move", start, 0.1, 0.0))
                _highest_mm(other)


def _do(talk: Talk, command: str) -> None:
    if (reply := talk.ask(command)) != "done":
        raise _NotDone(f"'{command.partition(' :')[0]}' was answered '{reply}'")


def _upwards(frame: Sequence[float], way_mm: float) -> str:
    x, y, z, *angles = frame
    words = [f"{value:.9f}" for value in (x, y, z + way_mm, *angles)]
    return f"linstiff move : {' '.join(words)} {UP_SPEED} 4000 0 0 0 0 0 0"


def _a7(command: str, joints: Sequence[float], speed: float, way_rad: float = WAY_RAD) -> str:
    target = [*joints[:-1], joints[-1] + way_rad]
    words = [f"{value:.9f}" for value in target] + [str(speed)] * len(target)
    return f"{command} : {' '.join(words)}"


def _highest_mm(talk: Talk) -> float:
    """Wait until the joints are still, whatever the status; return the largest height of the TCP meanwhile.

    Raises OSError if the robot does not come to rest.
    """
    time.sleep(1.5 * LOOKS_S)  # the motion may not have begun
    deadline = time.monotonic() + REST_S
    highest, still = -float("inf"), 0
    while still < STILL_LOOKS:
        if time.monotonic() > deadline:
            raise OSError(f"the robot still moves after {REST_S:g} s")
        still = 0 if _moves(talk) else still + 1
        highest = max(highest, talk.numbers("get tool frame")[2])
    return highest


def _moves(talk: Talk) -> bool:
    before = talk.numbers("get joint position")
    time.sleep(LOOKS_S)
    now = talk.numbers("get joint position")
    return any(abs(one - other) > AT_REST_RAD for one, other in zip(now, before, strict=False))


PROBES = (
    _probe("`done` behind a move", "it was accepted, not that it has arrived", _done_is_not_arrived),
    _probe("stop, on the way", "`done`, and every move that waits is discarded", _stop_forgets),
    _probe("a client that goes while its move runs", "the robot stops", _gone_client),
    _probe(
        "a malformed move in another mode",
        "`error`, and yet the running motion is stopped",
        _malformed_move,
        "`error`, and nothing changes",
    ),
    _probe("a stiffness move while another runs", "it replaces that one", _stiffness_move_replaces),
)
