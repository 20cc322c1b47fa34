"""Moves of benchmarks for a stepped controller, sent at once or one after the other.

Only public behaviour of the controller is used, so that planners can be compared.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.requests import JOINT_BLENDING, Kind, MoveRequest
from iiwa_sim.frames import Frame

Joints = tuple[float, ...]

AT_ONCE = "at once"
ONE_A_TICK = "one a tick"
FOUR_WAIT = "as four wait"
FEEDS = (AT_ONCE, ONE_A_TICK, FOUR_WAIT)
"""When moves are sent: all before the first tick, one before each tick, or as long as fewer than four
wait."""
ENOUGH = 4
LONGEST_S = 600.0


class Told(NamedTuple):
    """A move: `kind` is lin, ptp or joint, the target a frame of the TCP, or joints (rad)."""

    kind: str
    target: Frame | Joints
    speed_rel: float
    blending_mm: float = 0.0

    @classmethod
    def from_line(cls, line: str) -> "Told":
        """The move of a `lin move` or a `ptp move` in the line protocol."""
        command, values = line.split(" : ")
        *frame, speed_rel, blending_mm = map(float, values.split())
        return cls(command.removesuffix(" move"), Frame(*frame), speed_rel, blending_mm)

    @property
    def line(self) -> str:
        """The move as a line."""
        values = [*self.target, self.speed_rel, self.blending_mm]
        if self.kind == "joint":
            values = [*self.target, *[self.speed_rel] * len(self.target)]
        return f"{self.kind} move : {' '.join(map(repr, values))}"

    def to(self, controller: Controller, blending: bool = True) -> int:
        """Send the move, with or without its blending; returns its number, or raises `Refused`."""
        if self.kind == "joint":
            joints = tuple(self.target)
            speeds = [self.speed_rel] * len(joints)
            return controller.move(MoveRequest(Kind.PTP, joints, speeds=speeds, blending=JOINT_BLENDING))
        target, kind = Frame(*self.target), Kind.LIN if self.kind == "lin" else Kind.PTP
        return controller.move(
            MoveRequest(kind, target, self.speed_rel, self.blending_mm if blending else 0.0)
        )


def run(
    controller: Controller, moves: Sequence[Told], feed: str = AT_ONCE, blending: bool = True
) -> NDArray[np.float64]:
    """Joint positions (ticks + 1, n) from rest to rest (rad), with moves sent according to `feed`."""
    unsent = list(reversed(moves))
    joints = [controller.joints]
    while unsent or controller.moving:
        sent = 0
        while unsent and _is_due(feed, sent, controller):
            unsent.pop().to(controller, blending)
            sent += 1
        controller.step()
        joints.append(controller.joints)
        if len(joints) * controller.tick_s > LONGEST_S:
            raise RuntimeError(f"still moving after {LONGEST_S:g} s")
    return np.array(joints)


def _is_due(feed: str, sent: int, controller: Controller) -> bool:
    """Whether the next move is to be sent; `sent` counts those since the last tick."""
    if feed == FOUR_WAIT:
        return not controller.moving or controller.queue < ENOUGH
    return feed == AT_ONCE or sent == 0
