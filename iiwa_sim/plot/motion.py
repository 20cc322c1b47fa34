"""What a picture shows of a robot: its state over time, its moves and its faults."""

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import Kind
from iiwa_sim.protocols.krc4_xml import from_short, is_short, load_krc4_table, understand
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.table import Request, load_table
from iiwa_sim.recordings import watch
from iiwa_sim.robot.description import RobotDescription

Array = NDArray[np.float64]

_STREAMED = (Mode.SMART.value, Mode.DIRECT.value)
_KRC4_KINDS = {"LIN": Kind.LIN, "LIA": Kind.LIN, "PTP": Kind.PTP, "PTA": Kind.PTP}
_SPEED_OF_A_JOINT = re.compile(r"v\d")


@dataclass(frozen=True)
class Move:
    """A move that has begun."""

    goal_mm: tuple[float, ...]
    """Position of the TCP in the base at its end."""
    name: str
    """Command, speed and blending radius (mm), as `LIN 0.5 r30`; empty for a move that no line asked for."""
    blending_mm: float
    """Commanded blending radius; 0 if the command has none."""
    streamed: bool
    """Whether it is a target of a servo mode, replaced by the next."""
    end_s: float | None = None
    """When it reached its target, ran into the next move or was ended by a force; None if it did not."""


@dataclass(frozen=True)
class Motion:
    """A robot over time, with n samples. Joints base first."""

    path: str
    description: RobotDescription
    times_s: Array
    """(n,), simulated"""
    joints: Array
    """(n, joints), rad"""
    velocity: Array
    """(n, joints), rad/s"""
    tcp_mm: Array
    """(n, 3), in the base"""
    force_n: Array
    """(n, 3), the values of `get cartesian force`, along the axes of the TCP"""
    moves: tuple[Move, ...]
    faults: tuple[tuple[float, int], ...]
    """Beginnings of the error state: time (s) and code."""

    def tcp_speed_mm_s(self) -> Array:
        """Return the mean speed of the TCP since the sample before, (n,)."""
        way_mm = np.sqrt((np.diff(self.tcp_mm, axis=0, prepend=self.tcp_mm[:1]) ** 2).sum(axis=1))
        speed: Array = way_mm / np.diff(self.times_s, prepend=-1.0)
        return speed


class History:
    """Moves and faults, from lines of clients and events in the order in which they came."""

    def __init__(self) -> None:
        self._line = ""
        self._asked: dict[int, tuple[str, float]] = {}  # by the numbers of moves: name and blending radius
        self._moves: dict[int, Move] = {}
        self._faults: list[tuple[float, int]] = []

    def say(self, line: str) -> None:
        """Note the line that a client sends; the moves accepted until the next call are its own."""
        self._line = line

    def happen(self, time_s: float, event: watch.Event) -> None:
        """Note an event."""
        if event.kind == watch.ACCEPTED and self._line:
            self._asked[event.move] = named(self._line)
        elif event.kind == watch.BEGINS and event.goal:
            name, blending_mm = self._asked.get(event.move, ("", 0.0))
            self._moves[event.move] = Move(event.goal[:3], name, blending_mm, event.text in _STREAMED)
        elif event.kind == watch.ENDS and event.code == 0 and event.move in self._moves:
            self._moves[event.move] = replace(self._moves[event.move], end_s=time_s)
        elif event.kind == watch.FAULT:
            self._faults.append((time_s, event.code))

    @property
    def moves(self) -> tuple[Move, ...]:
        """The moves that have begun, in that order."""
        return tuple(self._moves.values())

    @property
    def faults(self) -> tuple[tuple[float, int], ...]:
        """Times (s) and codes."""
        return tuple(self._faults)


def named(line: str) -> tuple[str, float]:
    """Return name and blending radius (mm) of a move that is a line in any protocol; "" and 0 for others."""
    if is_short(line):
        try:
            command = understand(from_short(line)).command
        except ValueError:
            return "", 0.0
        known = load_krc4_table().get(command)
        return (_KRC4_KINDS[known.tag].value if known is not None and known.tag in _KRC4_KINDS else ""), 0.0
    request = load_table(IIWA).parse(line.encode())
    if not isinstance(request, Request):
        return "", 0.0
    names = [parameter.name for parameter in request.command.parameters]
    values = dict(zip(names, request.values, strict=True))
    speeds = {value for name, value in values.items() if name == "speed" or _SPEED_OF_A_JOINT.fullmatch(name)}
    blending_mm = values.get("blending", 0.0)
    words = [request.command.name.removesuffix(" move").upper()]
    if speeds:
        words.append("-".join(f"{each:g}" for each in sorted({min(speeds), max(speeds)})))
    if blending_mm:
        words.append(f"r{blending_mm:g}")
    return " ".join(words), blending_mm
