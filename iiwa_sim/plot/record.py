"""Runs a script through a session on a stepped controller and records every tick."""

from array import array
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.cell.cell import Cell
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.force_guard import Contact, Thresholds
from iiwa_sim.controller.meetings import touches_of
from iiwa_sim.frames import Frame, Vector
from iiwa_sim.plot.clients import CLIENTS, SERVO_MODES, Asked, Client
from iiwa_sim.plot.script import LONGEST_S, Command, Script, Wait
from iiwa_sim.plot.things import Things, ThingsOverTime
from iiwa_sim.robot.description import RobotDescription

Array = NDArray[np.float64]

REST_TICKS = 3
"""Ticks recorded after the last motion, so that its end shows in the differences."""


@dataclass(frozen=True)
class Target:
    """The target of an accepted command."""

    line: int
    """Line of the file."""
    tcp_mm: Vector
    """Position in the base."""
    blending_mm: float
    """Commanded blending radius; 0 if the command has none."""
    mode: str
    """Mode of the controller that the command needs."""
    done_tick: int | None = None
    """Tick in which the move ended, ran into the next or was ended by a force; None if none of that
    happened."""
    name: str = ""
    """Kind, speed and blending radius of the move, as `LIN 0.5 r30`; empty where they are not known."""

    @property
    def servo(self) -> bool:
        """Whether it is a target of a servo stream, replaced by the next."""
        return self.mode in SERVO_MODES


@dataclass(frozen=True)
class Watch:
    """The guard of a force move: its thresholds and its outcome."""

    thresholds_n: Thresholds
    offset_n: Vector
    """Force at the command, along the axes of the TCP."""
    ticks: tuple[int, int] | None = None
    """First and last tick in which the force was compared with the thresholds; None if there was none."""
    contact: Contact | None = None
    """The contact that ended the move in the last of these ticks; None if nothing did."""


@dataclass(frozen=True)
class Fault:
    """The beginning of the error state."""

    tick: int
    code: int
    """Of `iiwa_sim.controller.errors`."""


@dataclass(frozen=True)
class Recording:
    """The robot at every tick, from rest at tick 0. Joints base first; arrays over ticks have n + 1 rows."""

    script: Script
    description: RobotDescription
    tick_s: float
    joints: Array
    """(n + 1, joints), rad"""
    tcp_mm: Array
    """(n + 1, 3), in the base"""
    tcp_turn: Array
    """(n + 1, 3), alpha beta gamma of the TCP (rad)"""
    force_n: Array
    """(n + 1, 3), the values of `get cartesian force`, along the axes of the TCP"""
    targets: tuple[Target, ...]
    watches: tuple[Watch, ...]
    things: ThingsOverTime
    """What it works with, and touches."""
    surfaces: tuple[Surface, ...] = ()
    """What stands round the robot."""
    faults: tuple[Fault, ...] = ()
    """What has gone wrong between commands, as a protective stop."""

    @property
    def has_forces(self) -> bool:
        """Whether there is any force or threshold to draw."""
        return bool(self.watches) or bool(self.force_n.any())

    @property
    def duration_s(self) -> float:
        """Simulated time."""
        return (len(self.joints) - 1) * self.tick_s

    def tcp(self, tick: int) -> Frame:
        """The TCP in the base at a tick."""
        return Frame(*self.tcp_mm[tick].tolist(), *self.tcp_turn[tick].tolist())

    def times_s(self) -> Array:
        """(n + 1,)"""
        return np.arange(len(self.joints), dtype=np.float64) * self.tick_s

    def velocity(self) -> Array:
        """(n + 1, joints), rad/s: the mean over the tick before, so the first row is 0."""
        return self._rate(self.joints)

    def acceleration(self) -> Array:
        """(n + 1, joints), rad/s^2: the change of velocity over the tick."""
        return self._rate(self.velocity())

    def tcp_speed_mm_s(self) -> Array:
        """(n + 1,)"""
        speed: Array = np.sqrt((self._rate(self.tcp_mm) ** 2).sum(axis=1))
        return speed

    def _rate(self, values: Array) -> Array:
        rate: Array = np.diff(values, axis=0, prepend=values[:1]) / self.tick_s
        return rate


def record(script: Script, cell: Cell, rate_hz: int) -> Recording:
    """Run a script in a cell to the end of all motion.

    Raises `PlotFault` if a line is refused or the time exceeds `LONGEST_S`, and `RobotFault` for a robot that
    cannot be used.
    """
    recorder = _Recorder(script, cell, rate_hz)
    for step in script.steps:
        if isinstance(step, Wait):
            recorder.wait(step)
        else:
            recorder.send(step)
    return recorder.finish()


class _Recorder:
    """A controller with one client, and what has been recorded so far."""

    def __init__(self, script: Script, cell: Cell, rate_hz: int) -> None:
        self._script = script
        self._cell = cell
        self._rate_hz = rate_hz
        self._controller = cell.controller(1.0 / rate_hz, on_contact=self._met, on_fault=self._failed)
        self._client: Client = CLIENTS[script.dialect](self._controller, cell, script.path)
        self._joints = array("d")
        self._tcp = array("d")
        self._force_n = array("d")
        handled, tool = cell.handled, () if cell.tool is None else cell.tool.capsules
        self._things = ThingsOverTime(tool=tool)
        if handled is not None:
            shapes = {part.name: part.shape for part, _ in handled.parts}
            self._things = ThingsOverTime(shapes, handled.jaws.jaw_m, tool)
        self._targets: list[Target] = []
        self._faults: list[Fault] = []
        self._watches: dict[int, Watch] = {}  # by the numbers of their moves
        self._pending: dict[int, int] = {}  # indices of targets, by the numbers of their moves
        self._due_s = 0.0  # time of the script: rounding of waits to ticks does not accumulate
        self._look()

    def send(self, command: Command) -> None:
        """Send a line and note its effect."""
        offset_n = self._controller.cartesian_force()[:3]
        try:
            asked = self._client.say(command.text)
        except ValueError as refusal:
            raise self._script.fault(command, str(refusal)) from None
        self._add_target(command.line, asked)
        self._add_watch(asked, offset_n)
        self._forget_pending()

    def wait(self, wait: Wait) -> None:
        """Step until a wait is over."""
        if wait.seconds is None:
            while self._controller.moving:
                self._step(wait)
            self._due_s = self._controller.tick / self._rate_hz
            return
        self._due_s += wait.seconds
        while self._controller.tick < round(self._due_s * self._rate_hz):
            self._step(wait)

    def finish(self) -> Recording:
        """Step until the robot rests."""
        last = self._script.steps[-1]
        while self._controller.moving or self._controller.under_way:  # the gripper, too
            self._step(last)
        for _ in range(REST_TICKS):
            self._step(last)
        return Recording(
            script=self._script,
            description=self._cell.description,
            tick_s=self._controller.tick_s,
            joints=np.array(self._joints).reshape(-1, len(self._cell.description.joints)),
            tcp_mm=np.array(self._tcp).reshape(-1, 6)[:, :3],
            tcp_turn=np.array(self._tcp).reshape(-1, 6)[:, 3:],
            force_n=np.array(self._force_n).reshape(-1, 3),
            targets=tuple(self._targets),
            watches=tuple(self._watches.values()),
            things=self._things,
            surfaces=self._cell.surfaces,
            faults=tuple(self._faults),
        )

    def _step(self, step: Command | Wait) -> None:
        controller = self._controller
        if controller.tick >= LONGEST_S * self._rate_hz:
            raise self._script.fault(step, f"more than {LONGEST_S:g} s of simulated time")
        controller.step()
        self._look()
        self._watched(controller.move_under_way)
        for target in self._forget_pending():
            self._targets[target] = replace(self._targets[target], done_tick=controller.tick)

    def _look(self) -> None:
        """Note where the robot is, and what it works with."""
        controller = self._controller
        handling = controller.handling
        self._joints.extend(controller.joints)
        self._tcp.extend(controller.tool_frame())
        self._force_n.extend(controller.cartesian_force()[:3])
        state, parts = (None, ()) if handling is None else (handling.state, handling.parts)
        self._things.add(Things(controller.tick, state, parts, touches_of(controller.load.link_contacts)))

    def _forget_pending(self) -> list[int]:
        """Update targets whose moves have ended: done after a tick, dropped after a command."""
        if not self._pending:
            return []
        over = [number for number in self._pending if not self._controller.is_pending(number)]
        return [self._pending.pop(number) for number in over]

    def _add_watch(self, asked: Asked, offset_n: Vector) -> None:
        if asked.move is not None and asked.thresholds_n != (None, None, None):
            self._watches[asked.move] = Watch(asked.thresholds_n, offset_n)

    def _watched(self, move: int) -> None:
        """Note that a guarded move was running in this tick, so forces were compared at its end."""
        watch, tick = self._watches.get(move), self._controller.tick
        if watch is not None:
            self._watches[move] = replace(watch, ticks=(watch.ticks[0] if watch.ticks else tick, tick))

    def _met(self, contact: Contact) -> None:
        self._watched(contact.move)
        self._watches[contact.move] = replace(self._watches[contact.move], contact=contact)

    def _failed(self, code: int, _: str) -> None:
        self._faults.append(Fault(self._controller.tick, code))

    def _add_target(self, line: int, asked: Asked) -> None:
        if asked.tcp is None:
            return
        x, y, z = asked.tcp.translation
        target = Target(line, (1e3 * x, 1e3 * y, 1e3 * z), asked.blending_mm, asked.mode, name=asked.name)
        if asked.move is not None and not target.servo:
            self._pending[asked.move] = len(self._targets)
        self._targets.append(target)
