"""The motion on a picture: read from a recording, or made by a file of commands.

A file of commands has one command per line, as on the wire. Text behind a `#` is a comment; blank lines are
skipped. Commands follow each other within one tick, except where the file says

    wait SECONDS        the robot moves on for so long, in simulated time
    wait stopped        until `get status` would say stopped
    protocol krc4       above all commands: these are KRC4 messages, in short form or verbatim
"""

import re
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.cell.cell import Cell
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import Kind
from iiwa_sim.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.log import SessionLog
from iiwa_sim.protocols.decimals import parse_decimal
from iiwa_sim.protocols.faults import CannedReplies
from iiwa_sim.protocols.krc4_xml import from_short, is_short, load_krc4_table, to_xml, understand
from iiwa_sim.protocols.ports import DEFAULT_PORTS, DEFAULT_PROTOCOL, IIWA, KRC4
from iiwa_sim.protocols.protocols import protocol_for
from iiwa_sim.protocols.table import Request, load_table
from iiwa_sim.recordings import watch
from iiwa_sim.recordings.read import Happened, Recorded, Spoken
from iiwa_sim.recordings.recorder import Recorder
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot
from iiwa_sim.wording import Unusable, harmless, shortened

Array = NDArray[np.float64]

LONGEST_S = 600.0
"""Longest simulated time (s) of a file of commands."""
MAX_BYTES = 10_000_000
"""Largest file in bytes; a larger one is no file of commands."""
MOST_SAMPLES = 60_000
"""Most samples of a picture, two minutes at 500 Hz; a longer recording is thinned out."""
REST_TICKS = 3
"""Ticks after the last motion, so that its end shows."""
LONGEST_MESSAGE = 400
"""Most characters of a message, which may quote paths and commands."""

_STREAMED = (Mode.SMART.value, Mode.DIRECT.value)
_KRC4_KINDS = {"LIN": Kind.LIN, "LIA": Kind.LIN, "PTP": Kind.PTP, "PTA": Kind.PTP}
_SPEED_OF_A_JOINT = re.compile(r"v\d")


class PlotFault(Unusable):
    """A picture cannot be made. The message is one line that names the file and what is wrong."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


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
    """True for a target of a servo mode, which the next one replaces."""
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


def motion_in(recorded: Recorded) -> Motion:
    """Read the motion in a recording.

    Raises PlotFault if there is nothing to draw, RecordingFault and RobotFault.
    """
    rows: list[tuple[float, ...]] = []
    for state in recorded.states():
        time_s = state.tick / recorded.head.tick_rate_hz
        if not rows or time_s > rows[-1][0]:
            places = (*state.tool_frame[:3], *state.cartesian_force[:3])
            rows.append((time_s, *state.joint_position, *state.joint_velocity, *places))
    if len(rows) < 2:
        raise PlotFault(f"{recorded.path}: expected two states at least, to draw a picture of")
    values = np.array(rows[:: -(-len(rows) // MOST_SAMPLES)])
    start_s, count = rows[0][0], len(recorded.head.joints)
    moves, faults = _history(recorded, start_s)
    return Motion(
        path=str(recorded.path),
        description=_description(recorded),
        times_s=values[:, 0] - start_s,
        joints=values[:, 1 : 1 + count],
        velocity=values[:, 1 + count : 1 + 2 * count],
        tcp_mm=values[:, 1 + 2 * count : 4 + 2 * count],
        force_n=values[:, 4 + 2 * count :],
        moves=tuple(moves),
        faults=tuple(faults),
    )


def _history(recorded: Recorded, start_s: float) -> tuple[list[Move], list[tuple[float, int]]]:
    """Return the moves that have begun, and times (s) and codes of faults.

    A move has the name of the line that asked for it. Its acceptance is recorded between that line and the
    reply; before the line, in the same tick, if it ends another move.
    """
    line, unnamed = "", list[Happened]()
    names: dict[int, tuple[str, float]] = {}
    moves: dict[int, Move] = {}
    faults: list[tuple[float, int]] = []
    for each in recorded.said_and_happened():
        if isinstance(each, Spoken):
            line = each.text if each.direction == Direction.FROM_CLIENT.value else ""
            if line and named(line)[0]:
                names |= {event.move: named(line) for event in unnamed if event.tick == each.tick}
                unnamed.clear()
            continue
        time_s = each.tick / recorded.head.tick_rate_hz - start_s
        if each.kind == watch.ACCEPTED and line:
            names[each.move] = named(line)
        elif each.kind == watch.ACCEPTED:
            unnamed.append(each)
        elif each.kind == watch.BEGINS and each.goal_frame:
            moves[each.move] = Move(each.goal_frame[:3], "", 0.0, each.text in _STREAMED)
        elif each.kind == watch.ENDS and each.code == 0 and each.move in moves:
            moves[each.move] = replace(moves[each.move], end_s=time_s)
        elif each.kind == watch.FAULT:
            faults.append((time_s, each.code))
    for number, (name, blending_mm) in names.items():
        if number in moves:
            moves[number] = replace(moves[number], name=name, blending_mm=blending_mm)
    return list(moves.values()), faults


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
    if request.command.mode == "any":
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


def _description(recorded: Recorded) -> RobotDescription:
    """Load the robot whose files are in the recording."""
    with tempfile.TemporaryDirectory() as folder:
        for name in (SETTINGS_FILE, URDF_FILE):
            content = recorded.head.attachments.get(name)
            if content is None:
                raise PlotFault(f"{recorded.path}: there is no {name} in it, by which to draw the robot")
            Path(folder, name).write_bytes(content)
        return load_robot(folder)


class Command(NamedTuple):
    """A line for the robot."""

    line: int
    """The number of the line in the file, from 1."""
    text: str


class Wait(NamedTuple):
    """A wait of simulated time before the next command."""

    line: int
    text: str
    seconds: float | None
    """Simulated time to wait. With None the wait ends when the robot has stopped."""


class Script(NamedTuple):
    """A parsed file of commands."""

    path: str
    steps: tuple[Command | Wait, ...]
    protocol: str = DEFAULT_PROTOCOL

    def fault(self, step: Command | Wait, reason: str) -> PlotFault:
        """Build the error for a step, with the file, the line, its text and the reason."""
        return PlotFault(f"{self.path}: line {step.line}: '{step.text}': {reason}")


def read_script(path: str) -> Script:
    """Read a file of commands. Raises PlotFault."""
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise PlotFault(f"{path}: cannot be read: {fault.strerror}") from None
    if len(data) > MAX_BYTES:
        raise PlotFault(f"{path}: expected a file of commands, of at most {MAX_BYTES} bytes")
    return parse_script(path, data)


def parse_script(path: str, data: bytes) -> Script:
    """Parse the bytes of a file; `path` names it in messages. Raises PlotFault."""
    try:
        lines = data.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise PlotFault(f"{path}: expected text in UTF-8 ({fault})") from None
    steps: list[Command | Wait] = []
    protocol = DEFAULT_PROTOCOL
    for number, line in enumerate(re.split(r"\r\n|\n|\r", lines), start=1):
        text = line.partition("#")[0].strip(" \t")
        if text.split()[:1] == ["protocol"]:
            protocol = text.removeprefix("protocol").strip()
            if protocol not in DEFAULT_PORTS or steps:
                known = " or ".join(DEFAULT_PORTS)
                raise PlotFault(f"{path}: line {number}: '{text}': expected {known}, above all commands")
        elif text:
            steps.append(_step(path, number, text))
    if not steps:
        raise PlotFault(f"{path}: expected commands, one per line, and found none")
    return Script(path, tuple(steps), protocol)


def _step(path: str, number: int, text: str) -> Command | Wait:
    words = text.lower().split()
    if words[:1] != ["wait"]:
        return Command(number, text)
    if words[1:] == ["stopped"]:
        return Wait(number, text, None)
    try:
        (word,) = words[1:]
        seconds = parse_decimal(word.encode())
    except ValueError:  # not one word, or no number
        seconds = -1.0
    if not 0.0 <= seconds <= LONGEST_S:
        expected = f"expected 'wait SECONDS', 0 to {LONGEST_S:g}, or 'wait stopped'"
        raise PlotFault(f"{path}: line {number}: '{text}': {expected}")
    return Wait(number, text, seconds)


def run(script: Script, cell: Cell, rate_hz: int) -> Motion:
    """Run a script in a cell to the end of all motion.

    Raises PlotFault if a line is refused or the time exceeds `LONGEST_S`, and RobotFault for a robot that
    cannot be used.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "run.mcap")
        runner = _Runner(script, cell, rate_hz, path)
        try:
            runner.run()
        finally:
            runner.recorder.stop()
            runner.recorder.finish()
        return replace(motion_in(Recorded(path)), path=script.path, description=cell.description)


class _Runner:
    """A recorded controller with one client."""

    def __init__(self, script: Script, cell: Cell, rate_hz: int, path: Path) -> None:
        self._script = script
        self._rate_hz = rate_hz
        self._reason = ""  # why the last line was refused
        self._controller = cell.controller(1.0 / rate_hz, on_fault=self._failed)
        dialogue = Dialogue(lambda: self._controller.tick)
        self.recorder = Recorder(
            path,
            self._controller,
            dialogue,
            cell=cell,
            tick_rate_hz=rate_hz,
            clock=lambda: "stepped",
            in_haste=lambda: True,
        )
        self.recorder.start()
        dialogue.listeners.append(self._hear)
        protocol, log = protocol_for(script.protocol, cell.description), _Log()
        self._session = protocol.open_session(
            self._controller, log, script.path, dialogue, False, CannedReplies()
        )
        self._due_s = 0.0  # time of the script: rounding of waits to ticks does not accumulate

    def run(self) -> None:
        """Take all steps, and step until the robot rests, its gripper too."""
        for step in self._script.steps:
            if isinstance(step, Wait):
                self._wait(step)
            else:
                self._send(step)
        last = self._script.steps[-1]
        while self._controller.moving or self._controller.under_way:
            self._step(last)
        for _ in range(REST_TICKS):
            self._step(last)

    def _send(self, command: Command) -> None:
        session, text, self._reason = self._session, command.text, ""
        if session.closing:
            raise self._script.fault(command, "nothing is heard after bye")
        try:
            krc4, short = self._script.protocol == KRC4, is_short(text)
            session.receive(
                (to_xml(from_short(text)) if short else text.encode()) if krc4 else f"{text}\n".encode()
            )
        except ValueError as fault:
            raise self._script.fault(command, str(fault)) from None
        if not session.waiting:
            raise self._script.fault(command, "expected a whole message")
        session.answer(1)
        if session.waiting:
            raise self._script.fault(command, "expected one message")
        if self._reason:
            raise self._script.fault(command, self._reason)

    def _wait(self, wait: Wait) -> None:
        if wait.seconds is None:
            while self._controller.moving:
                self._step(wait)
            self._due_s = self._controller.tick / self._rate_hz
            return
        self._due_s += wait.seconds
        while self._controller.tick < round(self._due_s * self._rate_hz):
            self._step(wait)

    def _step(self, step: Command | Wait) -> None:
        if self._controller.tick >= LONGEST_S * self._rate_hz:
            raise self._script.fault(step, f"more than {LONGEST_S:g} s of simulated time")
        self._controller.step()
        self.recorder.tick()

    def _wire(self, text: str) -> bytes:
        if self._script.protocol == KRC4:
            return to_xml(from_short(text)) if is_short(text) else text.encode()
        return text.encode() + b"\n"

    def _failed(self, code: int, reason: str) -> None:
        self.recorder.fault(code, reason)

    def _hear(self, said: DialogueLine) -> None:
        self._reason = said.reason or self._reason


class _Log(SessionLog):
    """The log of the session, without refusals: these end the program with their reason."""

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        pass
