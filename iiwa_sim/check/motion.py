"""Probes that move the robot: A7 by at most 0.1 rad, the TCP by at most 40 mm upwards, slowly, and back."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from iiwa_sim.check.link import OURS, SAME, Finding, Link, Probe, Talk, deviates, untried

WAY_RAD = 0.1
SLOW = 0.02
UP_MM = 40.0
UP_SPEED = 0.05
STILL_MM = 0.05
STILL_LOOKS = 3
"""Number of equal readings that show rest: a robot that reverses is still for a moment."""
REST_S = 20.0
AT_REST_RAD = 1e-4
"""Movement of the readings of a robot at rest."""


def _done_is_not_arrived(link: Link) -> Finding:
    with _moved(link) as (talk, start):
        reply = talk.ask(_a7("joint move", start, SLOW))
        if reply != "done":
            return deviates(f"a joint move to 0.1 rad from here was answered '{reply}'")
        status = talk.ask("get status")
        return SAME if status == "moving" else deviates(f"`get status` behind it says '{status}'")


def _stop_forgets(link: Link) -> Finding:
    with _moved(link) as (talk, start):
        talk.ask(_a7("joint move", start, SLOW))
        talk.ask(_a7("joint move", start, SLOW, -WAY_RAD))
        if (reply := talk.ask("stop")) != "done":
            return deviates(f"stop was answered '{reply}'")
        _until_still(talk)
        position = talk.numbers("get joint position")
        time.sleep(0.5)
        if _moves(talk, position):
            return deviates("the robot went on to the move that waited")
        return SAME if abs(position[6] - start[6]) < WAY_RAD / 2 else deviates("the move was not stopped")


def _gone_client(link: Link) -> Finding:
    with _moved(link) as (_, start):
        with link.talk() as other:
            other.ask(_a7("joint move", start, SLOW))
        with link.talk() as other:
            _until_still(other)
            way = abs(other.numbers("get joint position")[6] - start[6])
        return SAME if way < 0.9 * WAY_RAD else deviates("the robot went on to its target")


def _servo_at_rest(link: Link) -> Finding:
    with _moved(link) as (talk, start):
        if (reply := talk.ask(_a7("smart joint move", start, 0.2, 0.02))) != "done":
            return untried(f"smart joint move was answered '{reply}'")
        _until_still(talk)
        status = talk.ask("get status")
        return OURS if status == "stopped" else SAME


def _malformed_move(link: Link) -> Finding:
    with _moved(link) as (talk, start):
        if (reply := talk.ask(_a7("smart joint move", start, SLOW))) != "done":
            return untried(f"smart joint move was answered '{reply}'")
        time.sleep(0.1)
        if (reply := talk.ask("lin move : 1")) != "error":
            return deviates(f"'lin move : 1' was answered '{reply}'")
        time.sleep(0.3)
        return OURS if _moves(talk, talk.numbers("get joint position")) else SAME


def _stiffness_move_replaces(link: Link) -> Finding:
    with _moved(link) as (talk, _):
        frame = talk.numbers("get tool frame")
        if (reply := talk.ask(_upwards(frame, UP_MM))) != "done":
            return untried(f"linstiff move was answered '{reply}'")
        time.sleep(0.3)
        if (reply := talk.ask(_upwards(frame, 0.0))) != "done":
            return deviates(f"a stiffness move while another runs was answered '{reply}'")
        if _highest_mm(talk, frame) > 0.9 * UP_MM:
            return deviates("it waits until the one before is done")
        return SAME


def _hold_cancels(link: Link) -> Finding:
    with _moved(link) as (talk, start):
        frame = talk.numbers("get tool frame")
        if (reply := talk.ask(_upwards(frame, UP_MM))) != "done":
            return untried(f"linstiff move was answered '{reply}'")
        time.sleep(0.3)
        if (reply := talk.ask("start gravity : 4000")) != "done":
            return deviates(f"`start gravity` while a move runs was answered '{reply}'")
        if _highest_mm(talk, frame) > 0.9 * UP_MM:
            return deviates("the hold begins when the move is done")
        refused = talk.ask(_a7("joint move", start, SLOW, 0.0)) == "error"
        return OURS if refused else SAME


def _upwards(frame: Sequence[float], way_mm: float) -> str:
    x, y, z, *angles = frame
    words = [f"{value:.9f}" for value in (x, y, z + way_mm, *angles)]
    return f"linstiff move : {' '.join(words)} {UP_SPEED} 4000 0 0 0 0 0 0"


def _highest_mm(talk: Talk, frame: Sequence[float]) -> float:
    """The largest height of the TCP above a frame until it is still."""
    highest = 0.0
    deadline = time.monotonic() + REST_S
    still = 0
    while still < STILL_LOOKS and time.monotonic() < deadline:
        before = talk.numbers("get tool frame")[2] - frame[2]
        time.sleep(0.1)
        after = talk.numbers("get tool frame")[2] - frame[2]
        still = still + 1 if abs(after - before) < STILL_MM else 0
        highest = max(highest, before, after)
    return highest


@contextmanager
def _moved(link: Link) -> Iterator[tuple[Talk, list[float]]]:
    """A connection and the robot's position; at the end the robot returns there."""
    start: list[float] = []
    try:
        with link.talk() as talk:
            start = talk.numbers("get joint position")
            yield talk, start
            talk.ask("stop")
            _until_still(talk)
    finally:
        if start:
            with link.talk() as talk:
                talk.ask("stop")
                _until_still(talk)
                talk.ask(_a7("joint move", start, 0.1, 0.0))
                _until_still(talk)


def _a7(command: str, joints: Sequence[float], speed: float, way_rad: float = WAY_RAD) -> str:
    target = [*joints[:-1], joints[-1] + way_rad]
    words = [f"{value:.9f}" for value in target] + [str(speed)] * len(target)
    return f"{command} : {' '.join(words)}"


def _until_still(talk: Talk) -> None:
    """Wait until the joints are still, whatever the status. Raises OSError if the robot does not come to
    rest."""
    time.sleep(0.15)  # the motion may not have begun
    deadline = time.monotonic() + REST_S
    while _moves(talk, talk.numbers("get joint position")):
        if time.monotonic() > deadline:
            raise OSError(f"the robot still moves after {REST_S:g} s")


def _moves(talk: Talk, position: Sequence[float]) -> bool:
    time.sleep(0.1)
    now = talk.numbers("get joint position")
    return any(abs(one - other) > AT_REST_RAD for one, other in zip(now, position, strict=False))


def _cannot_tell(_: Link) -> Finding:
    return untried("it takes eyes on the robot's speed")


def _nobody_pushes(_: Link) -> Finding:
    return untried("it takes a hand that pushes the robot")


PROBES = (
    Probe("`done` behind a move", "it was accepted, not that it has arrived", "", _done_is_not_arrived, True),
    Probe("stop, on the way", "`done`, and every move that waits is discarded", "", _stop_forgets, True),
    Probe("a client that goes while its move runs", "the robot stops", "", _gone_client, True),
    Probe(
        "`get status` in a servo mode, at rest",
        "`moving`",
        '`stopped`, as Appendix B says ("current robot state")',
        _servo_at_rest,
        True,
    ),
    Probe(
        "a malformed move in another mode",
        "`error`, and yet the running motion is stopped",
        "`error`, and nothing changes",
        _malformed_move,
        True,
    ),
    Probe(
        "a stiffness move while another runs",
        "it replaces that one",
        "",
        _stiffness_move_replaces,
        True,
    ),
    Probe(
        "`start gravity` while a move runs, and a joint move then",
        "the move is cancelled, the robot holds; the joint move waits for ever",
        "the same, and the joint move is refused: a queue that never moves helps nobody",
        _hold_cancels,
        True,
    ),
    Probe(
        "velocities of `smart joint move`",
        "reach the controller as goal speeds",
        "relative speed limits, as Appendix B says",
        _cannot_tell,
    ),
    Probe(
        "a push while no move runs",
        "is not known",
        "shows in `get cartesian force` and `get joint torque`",
        _nobody_pushes,
    ),
)
