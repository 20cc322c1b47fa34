"""The motion on a picture: read from a recording, or made by a file of commands.

A file of commands has one command per line, as on the wire. Text behind a `#` is a comment; blank lines are
skipped. Commands follow each other within one tick, except where the file says

    wait SECONDS        the robot moves on for so long, in simulated time
    wait stopped        until `get status` would say stopped
"""

import re
import tempfile
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.cell.cell import Cell
from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import Direction
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.table import Request, load_table
from iiwa_sim.recordings import RecordingFault
from iiwa_sim.recordings.read import Recording
from iiwa_sim.recordings.schemas import ACCEPTED, BEGINS, DIALOGUE, ENDS, EVENTS, FAULT, STATE, Event, Line
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.simulator import Simulator
from iiwa_sim.wording import shortened

LONGEST_S = 600.0
"""Longest simulated time (s) of a wait in a file of commands."""
MOST_SAMPLES = 60_000
"""Most states of a picture, two minutes at 500 Hz; a longer recording is thinned out."""
LONGEST_NAME = 32
"""Characters of a KRC4 message on a picture."""
REST_TICKS = 3
"""Ticks after the last motion, so that its end shows."""

_STREAMED = (Mode.SMART.value, Mode.DIRECT.value)
_SPEED_OF_A_JOINT = re.compile(r"v\d")


class Move(NamedTuple):
    """A move that has begun."""

    goal_mm: tuple[float, ...]
    """Position of the TCP in the base at its end."""
    name: str
    """Command, speed and blending radius (mm), as `LIN 0.5 r30`; empty for a target of a servo mode."""
    blending_mm: float
    """Commanded blending radius; 0 if the command has none."""
    end_s: float | None
    """When it reached its target, ran into the next move or was ended by a force; None if it did not."""


class Motion(NamedTuple):
    """A robot over time."""

    description: RobotDescription
    states: list[Snapshot]
    moves: list[Move]
    faults: list[tuple[float, int]]
    """Beginnings of the error state: time (s) and code."""


def motion_in(recorded: Recording) -> Motion:
    """Read a recording. Raises RecordingFault, also for less than two states, and RobotFault."""
    states = list({state.tick: state for state in recorded.contents(STATE)}.values())
    if len(states) < 2:
        raise RecordingFault(f"{recorded.path}: expected two states at least, to draw a picture of")
    accepted, names, faults = list[Event](), dict[int, tuple[str, float]](), []
    begun, ends_s = list[Event](), dict[int, float]()
    for each in recorded.contents(DIALOGUE, EVENTS):
        if isinstance(each, Line):  # it follows the acceptance of its moves, in the same tick
            if each.mark == Direction.FROM_CLIENT:
                names |= {event.move: named(each.text) for event in accepted if event.tick == each.tick}
                accepted.clear()
        elif each.kind == ACCEPTED:
            accepted.append(each)
        elif each.kind == BEGINS:
            begun.append(each)
        elif each.kind == ENDS and each.code == 0:
            ends_s[each.move] = each.time_s
        elif each.kind == FAULT:
            faults.append((each.time_s, each.code))
    moves = []
    for each in begun:
        name, blending_mm = names.get(each.move, (each.text, 0.0))
        name = "" if each.text in _STREAMED else name
        moves.append(Move(each.goal_frame[:3], name, blending_mm, ends_s.get(each.move)))
    return Motion(recorded.description(), states[:: -(-len(states) // MOST_SAMPLES)], moves, faults)


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


def run(path: Path, cell: Cell, rate_hz: int) -> Motion:
    """Run a file of commands in a cell to the end of all motion.

    Raises RecordingFault if it cannot be read or a line is refused.
    """
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        raise RecordingFault(f"{path}: cannot be read: {getattr(fault, 'strerror', None) or fault}") from None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        with (
            Simulator(cell=cell, clock="stepped", rate_hz=rate_hz, record=file) as robot,
            Iiwa(robot.host, robot.port) as driver,
        ):
            for number, line in enumerate([*lines, "wait stopped"], 1):
                text = line.partition("#")[0].strip()
                try:
                    _carry_out(text, robot, driver)
                except (CommandError, ValueError, OSError) as fault:
                    why = f"{fault.code} {fault.reason}" if isinstance(fault, CommandError) else fault
                    raise RecordingFault(f"{path}: line {number}: '{text}': {why}") from None
            while robot.call(lambda: robot.controller.under_way):  # the gripper
                robot.advance(1.0 / rate_hz)
            robot.advance(REST_TICKS / rate_hz)
        return motion_in(Recording(file))


def _carry_out(text: str, robot: Simulator, driver: Iiwa) -> None:
    """Send a command, or wait. Raises CommandError, ValueError and OSError."""
    word, _, rest = text.lower().partition(" ")
    if word == "wait" and rest.strip() == "stopped":
        robot.run_until_stopped(LONGEST_S)
    elif word == "wait":
        if not re.fullmatch(r"\s*[0-9.]+", rest) or float(rest) > LONGEST_S:
            raise ValueError(f"expected 'wait SECONDS', 0 to {LONGEST_S:g}, or 'wait stopped'")
        robot.advance(float(rest))
    elif text:
        driver.command(text)
