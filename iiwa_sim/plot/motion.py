"""The motion on a picture: read from a recording, or made by a file of commands.

A file of commands has one command per line, as on the wire. Text behind a `#` is a comment; blank lines are
skipped. Commands follow each other within one tick, except where the file says

    wait SECONDS        the robot moves on for so long, in simulated time
    wait stopped        until `get status` would say stopped
    protocol krc4       above all commands: these are KRC4 messages, in short form or verbatim
"""

import re
import tempfile
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.cell.cell import Cell
from iiwa_sim.client.connection import Connection
from iiwa_sim.client.krc4 import END_OF_REPLY
from iiwa_sim.controller.modes import Mode
from iiwa_sim.dialogue import Direction
from iiwa_sim.protocols.krc4_xml import from_short, is_short, load_krc4_table, to_xml, understand
from iiwa_sim.protocols.ports import DEFAULT_PORTS, DEFAULT_PROTOCOL, IIWA, KRC4
from iiwa_sim.protocols.table import Request, load_table
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.schemas import (
    ACCEPTED,
    BEGINS,
    DIALOGUE,
    ENDS,
    EVENTS,
    FAULT,
    STATE,
    Event,
    Spoken,
)
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.simulator import Simulator
from iiwa_sim.wording import Unusable, harmless, shortened

Array = NDArray[np.float64]

LONGEST_S = 600.0
"""Longest simulated time (s) of a file of commands."""
MOST_SAMPLES = 60_000
"""Most samples of a picture, two minutes at 500 Hz; a longer recording is thinned out."""
REST_TICKS = 3
"""Ticks after the last motion, so that its end shows."""
REPLY_S = 5.0
STOPPED = -1.0
"""Seconds that stand for a wait until the robot has stopped."""

_STREAMED = (Mode.SMART.value, Mode.DIRECT.value)
_KRC4_KINDS = {"LIN": "LIN", "LIA": "LIN", "PTP": "PTP", "PTA": "PTP"}
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

    def tcp_speed_mm_s(self) -> Array:
        """Return the mean speed of the TCP since the sample before, (n,)."""
        way_mm = np.sqrt((np.diff(self.tcp_mm, axis=0, prepend=self.tcp_mm[:1]) ** 2).sum(axis=1))
        speed: Array = way_mm / np.diff(self.times_s, prepend=-1.0)
        return speed


def motion_in(recorded: Recorded) -> Motion:
    """Read the motion in a recording.

    Raises PlotFault if there is nothing to draw, RecordingFault and RobotFault.
    """
    states = {state.tick: state for state in recorded.contents(STATE)}
    if len(states) < 2:
        raise PlotFault(f"{recorded.path}: expected two states at least, to draw a picture of")
    shown = list(states.values())[:: -(-len(states) // MOST_SAMPLES)]
    start_s = shown[0].tick / recorded.tick_rate_hz
    moves, faults = _history(recorded, start_s)
    return Motion(
        path=str(recorded.path),
        description=recorded.description(),
        times_s=np.array([state.tick / recorded.tick_rate_hz - start_s for state in shown]),
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
            if each.mark == Direction.FROM_CLIENT.value:
                name = named(each.text)
                names |= {event.move: name for event in accepted if event.tick == each.tick and name[0]}
                accepted.clear()
            continue
        time_s = each.tick / recorded.tick_rate_hz - start_s
        if each.kind == ACCEPTED:
            accepted.append(each)
        elif each.kind == BEGINS and each.goal_frame:
            moves[each.move] = Move(each.goal_frame[:3], each.text in _STREAMED)
        elif each.kind == ENDS and each.code == 0 and each.move in moves:
            moves[each.move].end_s = time_s
        elif each.kind == FAULT:
            faults.append((time_s, each.code))
    for number, move in moves.items():
        move.name, move.blending_mm = names.get(number, ("", 0.0))
    return list(moves.values()), faults


def named(line: str) -> tuple[str, float]:
    """Return name and blending radius (mm) of a move that is a line in any protocol; "" and 0 for others."""
    if is_short(line):
        try:
            known = load_krc4_table().get(understand(from_short(line)).command)
        except ValueError:
            return "", 0.0
        return (_KRC4_KINDS.get(known.tag, "") if known else ""), 0.0
    request = load_table(IIWA).parse(line.encode())
    if not isinstance(request, Request) or request.command.mode == "any":
        return "", 0.0
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

    Raises PlotFault if it cannot be read, if a line is refused or if the time exceeds `LONGEST_S`.
    """
    protocol, steps = _steps(path)
    due_s = 0.0  # time of the file: rounding of waits to ticks does not accumulate
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        with (
            Simulator(cell=cell, clock="stepped", rate_hz=rate_hz, protocol=[protocol], record=file) as robot,
            closing(Connection(robot.host, robot.port, REPLY_S)) as connection,
        ):
            reasons: list[str] = []
            robot.dialogue.listeners.append(lambda said: reasons.append(said.reason))
            for number, text in [*steps, (0, "wait stopped")]:
                try:
                    if (wait_s := _wait_s(text)) is None:
                        reasons.clear()
                        _ask(connection, protocol, text)
                        if any(reasons):
                            raise ValueError(next(filter(None, reasons)))
                    elif wait_s == STOPPED:
                        robot.run_until_stopped(LONGEST_S)
                        due_s = robot.state().time_s
                    else:
                        due_s += wait_s
                        robot.advance(max(round(due_s * rate_hz) - robot.state().tick, 0) / rate_hz)
                    if due_s > LONGEST_S:
                        raise ValueError(f"more than {LONGEST_S:g} s of simulated time")
                except (ValueError, OSError) as fault:  # TimeoutError, too, of a robot that still moves
                    where = f"line {number}: '{text}': " if number else ""
                    raise PlotFault(f"{path}: {where}{fault}") from None
            while robot.call(lambda: robot.controller.under_way):  # the gripper
                robot.advance(1.0 / rate_hz)
            robot.advance(REST_TICKS / rate_hz)
        return replace(motion_in(Recorded(file)), path=str(path), description=cell.description)


def _steps(path: str | Path) -> tuple[str, list[tuple[int, str]]]:
    """Return the protocol of a file, and its lines with their numbers. Raises PlotFault."""
    try:
        lines = Path(path).read_text("utf-8-sig").splitlines()
    except OSError as fault:
        raise PlotFault(f"{path}: cannot be read: {fault.strerror}") from None
    except UnicodeDecodeError as fault:
        raise PlotFault(f"{path}: expected text in UTF-8 ({fault})") from None
    texts = [(number, line.partition("#")[0].strip()) for number, line in enumerate(lines, 1)]
    steps = [(number, text) for number, text in texts if text]
    protocol = DEFAULT_PROTOCOL
    if steps and steps[0][1].startswith("protocol"):
        number, text = steps.pop(0)
        protocol = text.removeprefix("protocol").strip()
        if protocol not in DEFAULT_PORTS:
            raise PlotFault(f"{path}: line {number}: '{text}': expected {' or '.join(DEFAULT_PORTS)}")
    if not steps:
        raise PlotFault(f"{path}: expected commands, one per line, and found none")
    return protocol, steps


def _ask(connection: Connection, protocol: str, text: str) -> None:
    """Send a command and read its reply. Raises ValueError and OSError."""
    if protocol == KRC4:
        connection.send(to_xml(from_short(text)) if is_short(text) else text.encode())
        connection.read_until(END_OF_REPLY)
    else:
        connection.send(f"{text}\n".encode())
        connection.read_line()


def _wait_s(text: str) -> float | None:
    """Return the seconds that a line waits, `STOPPED`, or None for a command. Raises ValueError."""
    word, _, rest = text.lower().partition(" ")
    if word != "wait":
        return None
    if rest.strip() == "stopped":
        return STOPPED
    with suppress(ValueError):
        if 0.0 <= (seconds := float(rest)) <= LONGEST_S:
            return seconds
    raise ValueError(f"expected 'wait SECONDS', 0 to {LONGEST_S:g}, or 'wait stopped'")
