"""Events of a robot, found in its readings and in the endings of its moves."""

from collections.abc import Callable

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import SUCCESS
from iiwa_sim.controller.modes import Mode

ACCEPTED, BEGINS, ENDS, FAULT = "move accepted", "move begins", "move ends", "fault"
AT_TARGET = "at its target"


class Watch:
    """Looks at a robot after each tick, and whenever a command may have changed it."""

    def __init__(self, controller: Controller, clock: Callable[[], str], tell: Callable[..., None]) -> None:
        """Watch until `close`.

        Args:
            controller: Controller of the robot.
            clock: Returns how time passes.
            tell: Takes kind, text, move, code and goal frame of an event; all but the kind may be left out.
        """
        self._robot, self._clock, self._tell = controller, clock, tell
        self._pace = clock()
        self._signs = self._read()
        self._begun = controller.accepted  # moves up to this number have begun, or are of no interest
        self.in_error = bool(controller.status().in_error)
        """True from a fault of the robot to its reset."""
        controller.endings.listeners.append(self._ended)

    def close(self) -> None:
        """Tell nothing more."""
        self._robot.endings.listeners.remove(self._ended)

    def look(self) -> None:
        """Tell what has changed."""
        robot, (mode, accepted, under_way, touches) = self._robot, self._signs
        self._signs = self._read()
        if robot.mode is not mode:
            self._tell("mode", f"{mode.value} -> {robot.mode.value}")
        for move in range(accepted + 1, robot.accepted + 1):
            self._tell(ACCEPTED, robot.mode.value, move)
        if robot.motions.under_way != under_way and robot.motions.under_way > self._begun:
            self._begin(robot.motions.under_way)
        if robot.load.touching != touches:
            self._tell("touch", "ends" if touches else "begins")
        if self.in_error and not robot.status().in_error:
            self.in_error = False
            self._tell("reset", "no error any more")
        if (pace := self._clock()) != self._pace:
            self._pace = pace
            self._tell("clock", pace)

    def ticked(self) -> None:
        """A tick has been made."""
        robot = self._robot
        if self.in_error or self._read() != self._signs:  # which is not so in most ticks
            self.look()
        # A servo's target or a stiffness move has no other sign of its beginning.
        if self._begun < robot.accepted and robot.mode is not Mode.NORMAL:
            if robot.motions.is_pending(robot.accepted):
                self._begin(robot.accepted)
            self._begun = robot.accepted

    def _read(self) -> tuple[Mode, int, int, bool]:
        robot = self._robot
        return robot.mode, robot.accepted, robot.motions.under_way, robot.load.touching

    def _begin(self, move: int) -> None:
        self._begun = move
        self._tell(BEGINS, self._robot.mode.value, move, goal_frame=tuple(self._robot.goal_frame()))

    def _ended(self, ending: Ending) -> None:
        self.look()
        if ending.move > self._begun and ending.code == SUCCESS:  # within the tick in which it began
            self._begun = ending.move
            self._tell(BEGINS, self._robot.mode.value, ending.move)
        self._tell(ENDS, ending.reason or AT_TARGET, ending.move, ending.code)
