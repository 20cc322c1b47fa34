"""Runs a file of commands through a session on a stepped controller."""

import numpy as np

from iiwa_sim.cell.cell import Cell
from iiwa_sim.log import SessionLog
from iiwa_sim.plot.motion import History, Motion
from iiwa_sim.plot.script import LONGEST_S, Command, Script, Wait
from iiwa_sim.protocols.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.protocols.faults import CannedReplies
from iiwa_sim.protocols.krc4_xml import from_short, is_short, to_xml
from iiwa_sim.protocols.ports import KRC4
from iiwa_sim.protocols.protocols import protocol_for
from iiwa_sim.recordings.watch import Event, Watch

REST_TICKS = 3
"""Ticks after the last motion, so that its end shows."""


def run(script: Script, cell: Cell, rate_hz: int) -> Motion:
    """Run a script in a cell to the end of all motion.

    Raises `PlotFault` if a line is refused or the time exceeds `LONGEST_S`, and `RobotFault` for a robot that
    cannot be used.
    """
    runner = _Runner(script, cell, rate_hz)
    for step in script.steps:
        if isinstance(step, Wait):
            runner.wait(step)
        else:
            runner.send(step)
    return runner.finish()


class _Runner:
    """A controller with one client, and its states so far."""

    def __init__(self, script: Script, cell: Cell, rate_hz: int) -> None:
        self._script = script
        self._cell = cell
        self._rate_hz = rate_hz
        self._controller = cell.controller(1.0 / rate_hz, on_fault=self._failed)
        self._history = History()
        self._watch = Watch(self._controller, lambda: "", self._happened)
        dialogue = Dialogue(lambda: self._controller.tick)
        dialogue.listeners.append(self._heard)
        protocol, log = protocol_for(script.protocol, cell.description), _Log()
        self._session = protocol.open_session(
            self._controller, log, script.path, dialogue, False, CannedReplies()
        )
        self._reason = ""  # why the last line was refused
        self._due_s = 0.0  # time of the script: rounding of waits to ticks does not accumulate
        self._rows: list[tuple[float, ...]] = []
        self._look()

    def send(self, command: Command) -> None:
        """Send a line."""
        session, text, self._reason = self._session, command.text, ""
        if session.closing:
            raise self._script.fault(command, "nothing is heard after bye")
        try:
            session.receive(self._wire(text))
        except ValueError as fault:
            raise self._script.fault(command, str(fault)) from None
        if not session.waiting:
            raise self._script.fault(command, "expected a whole message")
        session.answer(1)
        if session.waiting:
            raise self._script.fault(command, "expected one message")
        if self._reason:
            raise self._script.fault(command, self._reason)
        self._history.say("")

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

    def finish(self) -> Motion:
        """Step until the robot rests."""
        last = self._script.steps[-1]
        while self._controller.moving or self._controller.under_way:  # the gripper, too
            self._step(last)
        for _ in range(REST_TICKS):
            self._step(last)
        values, count = np.array(self._rows), len(self._cell.description.joints)
        return Motion(
            path=self._script.path,
            description=self._cell.description,
            times_s=np.arange(len(values)) / self._rate_hz,
            joints=values[:, :count],
            velocity=values[:, count : 2 * count],
            tcp_mm=values[:, 2 * count : 2 * count + 3],
            force_n=values[:, 2 * count + 3 :],
            moves=self._history.moves,
            faults=self._history.faults,
        )

    def _wire(self, text: str) -> bytes:
        if self._script.protocol == KRC4:
            return to_xml(from_short(text)) if is_short(text) else text.encode()
        return text.encode() + b"\n"

    def _step(self, step: Command | Wait) -> None:
        if self._controller.tick >= LONGEST_S * self._rate_hz:
            raise self._script.fault(step, f"more than {LONGEST_S:g} s of simulated time")
        self._controller.step()
        self._watch.ticked()
        self._look()

    def _look(self) -> None:
        robot = self._controller
        force_n = robot.cartesian_force()[:3]
        self._rows.append((*robot.joints, *robot.joint_velocity(), *robot.tool_frame()[:3], *force_n))

    def _heard(self, said: DialogueLine) -> None:
        if said.direction is Direction.FROM_CLIENT:
            self._history.say(said.text)
        else:
            self._reason = said.reason
            self._watch.look()

    def _happened(self, event: Event) -> None:
        self._history.happen(self._controller.tick / self._rate_hz, event)

    def _failed(self, code: int, reason: str) -> None:
        self._watch.fault(code, reason)


class _Log(SessionLog):
    """The log of the session, without refusals: these end the program with their reason."""

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        pass
