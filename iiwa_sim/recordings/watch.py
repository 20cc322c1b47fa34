"""Events of a robot, found in its readings and in calls of listeners."""

from collections.abc import Callable
from typing import NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import SUCCESS
from iiwa_sim.controller.modes import Mode


class Event(NamedTuple):
    """Something has happened by the present tick."""

    kind: str
    """One of those of docs/recordings.md."""
    text: str = ""
    move: int = 0
    """Number of the move it is about; 0 for none."""
    code: int = 0
    """Error code of robot_movement_interface; 0 for none."""
    goal: tuple[float, ...] = ()
    """Goal of a move that begins: the TCP in the base, x y z (mm) alpha beta gamma (rad)."""


ACCEPTED, BEGINS, ENDS, FAULT = "move accepted", "move begins", "move ends", "fault"
AT_TARGET = "at its target"


class Watch:
    """Looks at a robot after each tick, and whenever somebody may have told it something."""

    def __init__(
        self, controller: Controller, clock: Callable[[], str], tell: Callable[[Event], None]
    ) -> None:
        """`clock` says how time passes; `tell` takes what happens, from now on until `close`."""
        self._controller = controller
        self._clock = clock
        self._tell = tell
        self._mode = controller.mode
        self._pace = clock()
        self._accepted = controller.accepted
        self._under_way = controller.motions.under_way
        self._begun = controller.accepted  # moves up to this number have begun, or are of no interest
        self._touches = controller.load.touching
        self._in_error = bool(controller.status().in_error)
        self._signs: tuple[object, ...] = ()
        controller.endings.listeners.append(self._ended)

    def close(self) -> None:
        """Tell nothing more."""
        self._controller.endings.listeners.remove(self._ended)

    def look(self) -> None:
        """Tell what has changed."""
        controller = self._controller
        if controller.mode is not self._mode:
            before, self._mode = self._mode, controller.mode
            self._tell(Event("mode", f"{before.value} -> {self._mode.value}"))
        accepted = controller.accepted
        if accepted != self._accepted:
            for move in range(self._accepted + 1, accepted + 1):
                self._tell(Event(ACCEPTED, self._mode.value, move))
            self._accepted = accepted
        under_way = controller.motions.under_way
        if under_way != self._under_way:
            self._under_way = under_way
            if under_way > self._begun:
                self._begin(under_way)
        if controller.load.touching != self._touches:
            self._touches = not self._touches
            self._tell(Event("touch", "begins" if self._touches else "ends"))
        if self._in_error and not controller.status().in_error:
            self._in_error = False
            self._tell(Event("reset", "no error any more"))
        pace = self._clock()
        if pace != self._pace:
            self._pace = pace
            self._tell(Event("clock", pace))

    def ticked(self) -> None:
        """A tick has been made."""
        robot = self._controller
        signs = (robot.accepted, robot.motions.under_way, robot.load.touching, robot.mode)
        if signs != self._signs or self._in_error:  # which is not so in most ticks
            self._signs = signs
            self.look()
        # A servo's target or a stiffness move has no other sign of its beginning.
        if self._begun < self._accepted and self._mode is not Mode.NORMAL:
            move = self._accepted
            if self._controller.motions.is_pending(move):
                self._begin(move)
            self._begun = move

    def fault(self, code: int, reason: str) -> None:
        """The robot has met with something, by itself or as a test bench has it."""
        self._in_error = bool(self._controller.status().in_error)
        self._tell(Event(FAULT, reason, code=code))

    def _begin(self, move: int) -> None:
        self._begun = move
        goal = self._controller.goal_frame()
        self._tell(Event(BEGINS, self._mode.value, move, goal=tuple(goal)))

    def _ended(self, ending: Ending) -> None:
        self.look()
        if ending.move > self._begun and ending.code == SUCCESS:  # within the tick in which it began
            self._begun = ending.move
            self._tell(Event(BEGINS, self._mode.value, ending.move))
        self._tell(Event(ENDS, ending.reason or AT_TARGET, ending.move, ending.code))
