"""The motion on a picture: read from a recording, or made by a file of commands.

A file of commands has one command per line, as on the wire. Text behind a `#` is a comment; blank lines are
skipped. Commands follow each other within one tick, except where the file says

    wait SECONDS        the robot moves on for so long, in simulated time
    wait stopped        until `get status` would say stopped
"""

import re
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.cell.cell import Cell
from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.controller.modes import Mode
from iiwa_sim.dialogue import Direction
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.table import Request, load_table
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.schemas import ACCEPTED, BEGINS, DIALOGUE, ENDS, EVENTS, FAULT, STATE, Event, Spoken
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.simulator import Simulator
from iiwa_sim.wording import Unusable, harmless, shortened

Array = NDArray[np.float64]

LONGEST_S = 600.0
"""Longest simulated time (s) of a wait in a file of commands."""
MOST_SAMPLES = 60_000
"""Most samples of a picture, two minutes at 500 Hz; a longer recording is thinned out."""
LONGEST_NAME = 32
"""Characters of a KRC4 message on a picture."""
REST_TICKS = 3
"""Ticks after the last motion, so that its end shows."""

_STREAMED = (Mode.SMART.value, Mode.DIRECT.value)
_SPEED_OF_A_JOINT = re.compile(r"v\d")


class PlotFault(Unusable):
    """A picture cannot be made. The message is one line that names the file and what is wrong."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), 400))


@dataclass
class Move:
    """A move that has begun."""

    goal_mm: tuple[float, ...]
    """Position of the TCP in the base at its end."""
    streamed: bool
    """True for a target of a servo mode, which the next one replaces."""
    name: str = ""
    """Command, speed and blending radius (mm), as `LIN 0.5 r30`; empty for a move that no line asked for."""
    blending_mm: float = 0.0
    """Commanded blending radius; 0 if the command has none."""
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
    moves: list[Move]
    faults: list[tuple[float, int]]
    """Beginnings of the error state: time (s) and code."""


def motion_in(recorded: Recorded) -> Motion:
    """Read the motion in a recording.

    Raises PlotFault if there is nothing to draw, RecordingFault and RobotFault.
    """
    states = {state.tick: state for state in recorded.contents(STATE)}
    if len(states) < 2:
        raise PlotFault(f"{recorded.path}: expected two states at least, to draw a picture of")
    shown = list(states.values())[:: -(-len(states) // MOST_SAMPLES)]
    moves, faults = _history(recorded, shown[0].time_s)
    return Motion(
        path=str(recorded.path),
        description=recorded.description(),
        times_s=np.array([state.time_s - shown[0].time_s for state in shown]),
        joints=np.array([state.joint_position for state in shown]),
        velocity=np.array([state.joint_velocity for state in shown]),
        tcp_mm=np.array([state.tool_frame[:3] for state in shown]),
        force_n=np.array([state.cartesian_force[:3] for state in shown]),
        moves=moves,
        faults=faults,
    )


def _history(recorded: Recorded, start_s: float) -> tuple[list[Move], list[tuple[float, int]]]:
    """Return the moves that have begun, and times (s) and codes of faults.

    A recording has the acceptance of a move before the line that asked for it, in the same tick.
    """
    accepted, names, moves, faults = list[Event](), dict[int, tuple[str, float]](), dict[int, Move](), []
    for each in recorded.contents(DIALOGUE, EVENTS):
        if isinstance(each, Spoken):
            if each.mark == Direction.FROM_CLIENT:
                name = named(each.text)
                names |= {event.move: name for event in accepted if event.tick == each.tick}
                accepted.clear()
        elif each.kind == ACCEPTED:
            accepted.append(each)
        elif each.kind == BEGINS:
            moves[each.move] = Move(each.goal_frame[:3], each.text in _STREAMED)
        elif each.kind == ENDS and each.code == 0 and each.move in moves:
            moves[each.move].end_s = each.time_s - start_s
        elif each.kind == FAULT:
            faults.append((each.time_s - start_s, each.code))
    for number, move in moves.items():
        move.name, move.blending_mm = names.get(number, ("", 0.0))
    return list(moves.values()), faults


def named(line: str) -> tuple[str, float]:
    """Return name and blending radius (mm) of a move; a KRC4 message stands for itself."""
    request = load_table(IIWA).parse(line.encode())
    if not isinstance(request, Request):
        return shortened(line, LONGEST_NAME), 0.0
    names = [parameter.name for parameter in request.command.parameters]
    values = dict(zip(names, request.values, strict=True))
    speeds = {value for name, value in values.items() if name == "speed" or _SPEED_OF_A_JOINT.fullmatch(name)}
    blending_mm = values.get("blending", 0.0)
    words = [request.command.name.removesuffix(" move").upper()]
    words += ["-".join(f"{each:g}" for each in sorted({min(speeds), max(speeds)}))] if speeds else []
    words += [f"r{blending_mm:g}"] if blending_mm else []
    return " ".join(words), blending_mm


def run(path: str | Path, cell: Cell, rate_hz: int) -> Motion:
    """Run a file of commands in a cell to the end of all motion.

    Raises PlotFault if it cannot be read or a line is refused.
    """
    try:
        lines = Path(path).read_text("utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        raise PlotFault(f"{path}: cannot be read: {getattr(fault, 'strerror', None) or fault}") from None
    texts = [line.partition("#")[0].strip() for line in lines]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        with (
            Simulator(cell=cell, clock="stepped", rate_hz=rate_hz, record=file) as robot,
            Iiwa(robot.host, robot.port) as driver,
        ):
            for number, text in enumerate([*texts, "wait stopped"], 1):
                try:
                    _carry_out(text, robot, driver)
                except (CommandError, ValueError, OSError) as fault:
                    why = f"{fault.code} {fault.reason}" if isinstance(fault, CommandError) else fault
                    where = f"line {number}: '{text}': " if number <= len(texts) else ""
                    raise PlotFault(f"{path}: {where}{why}") from None
            while robot.call(lambda: robot.controller.under_way):  # the gripper
                robot.advance(1.0 / rate_hz)
            robot.advance(REST_TICKS / rate_hz)
        return replace(motion_in(Recorded(file)), path=str(path), description=cell.description)


def _carry_out(text: str, robot: Simulator, driver: Iiwa) -> None:
    """Send a command, or wait. Raises CommandError, ValueError and OSError."""
    word, _, rest = text.lower().partition(" ")
    if not text:
        return
    if word != "wait":
        driver.command(text)
    elif rest.strip() == "stopped":
        robot.run_until_stopped(LONGEST_S)
    elif re.fullmatch(r"\s*[0-9.]+", rest) and float(rest) <= LONGEST_S:
        robot.advance(float(rest))
    else:
        raise ValueError(f"expected 'wait SECONDS', 0 to {LONGEST_S:g}, or 'wait stopped'")
