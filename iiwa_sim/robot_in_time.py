"""A robot and its clock, for callers of any thread: its state, and how its time passes."""

import logging

from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.clock.pace import Pace, pace
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.loop_or_thread import LoopOrThread
from iiwa_sim.motion.joints import Joints
from iiwa_sim.remembered import RememberedDialogue
from iiwa_sim.robot.urdf_check import differing_limits
from iiwa_sim.robot_events import RobotEvents, log_discarded

logger = logging.getLogger(__name__)


class RobotInTime(LoopOrThread):
    """A robot in its cell, the clock that steps it, and the dialogue of its clients."""

    def __init__(self, cell: Cell, rate_hz: int, clock: str | Pace, servo_timeout_s: float | None) -> None:
        """What these are is said in `Simulator`."""
        super().__init__("iiwa-sim")
        self.cell = cell
        for line in differing_limits(cell.description):
            logger.warning("%s", line)
        self.clock = Clock(rate_hz, _pace(clock))
        self.dialogue = RememberedDialogue(self._tick)
        """What is said in all protocols; `dialogue.listeners.append(listener)` hears it, and from
        `dialogue.remember()` on it can be asked for."""
        self._events = RobotEvents(self.dialogue)
        self._controller = cell.controller(
            self.clock.tick_s,
            servo_timeout_s=servo_timeout_s,
            on_fault=self._events.fault,
            on_contact=self._events.contact,
            on_touch=self._events.touch,
        )
        self._controller.endings.on_discarded = log_discarded
        if self._controller.handling is not None:
            self._controller.handling.tell_of_parts(self._events.part)

    @property
    def controller(self) -> Controller:
        """The robot's controller, as of now.

        To be had anew whenever something is asked of it or begun: a robot at rest does not tick until then.
        """
        return self.call(self._in_hand)

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self.call(lambda: self._controller.joints)

    def state(self) -> Snapshot:
        """The whole state of the robot, of one tick; the last one after the context has ended."""
        return self.call(lambda: snapshot(self._controller))

    def advance(self, seconds: float) -> None:
        """Let so much simulated time pass (0 to a day), at any clock, as fast as the machine can.

        A part of a tick counts as a whole one. Raises ValueError for a time out of range.
        """
        self._wait_for(lambda: self.clock.advance(seconds))

    def run_until_stopped(self, limit_s: float = 60.0) -> float:
        """Let time pass until `get status` would say stopped; gives how much did (s, simulated).

        As fast as the machine can, at any clock; none passes if the robot does not move. Raises StillMoving,
        a TimeoutError, where it still does after `limit_s` (0 to a day).
        """
        return self._wait_for(lambda: self.clock.run_until_stopped(limit_s))

    def pause(self) -> None:
        """Let time stand still until `resume`; `advance` and `run_until_stopped` still let it pass."""
        self.call(self.clock.pause)

    def resume(self) -> None:
        """Let time pass again."""
        self.call(self.clock.resume)

    def set_clock(self, clock: str | Pace) -> None:
        """Let time pass otherwise: "real", "10x", "fast", "stepped". Raises ValueError for anything else."""
        wanted = _pace(clock)
        self.call(lambda: self.clock.set_pace(wanted))

    def _catch_up(self) -> None:
        self.clock.catch_up()

    def _commanded(self) -> None:
        self.clock.commanded()

    def _in_hand(self) -> Controller:
        self.clock.look()
        return self._controller

    def _tick(self) -> int:
        """How many there have been by now."""
        self.clock.catch_up()
        return self._controller.tick


def _pace(clock: str | Pace) -> Pace:
    return clock if isinstance(clock, Pace) else pace(clock)
