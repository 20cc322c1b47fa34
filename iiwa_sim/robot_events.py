"""Events of the robot between commands, for the log, recordings and the dialogue."""

import logging
from collections.abc import Callable

from iiwa_sim import log
from iiwa_sim.controller.endings import Contact, RobotEvent
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.dialogue import Dialogue

ROBOT = "robot"
"""The name that the dialogue gives in place of a client's."""

logger = logging.getLogger(__name__)


class RobotEvents:
    """The events of one robot, reported by its controller; `name` is that of the robot in the log."""

    def __init__(self, dialogue: Dialogue, name: str = "") -> None:
        self.listeners: list[Callable[[str, str, int, int], None]] = []
        """Called with the kind and the text of an event, its move and its error code, 0 for none."""
        self._dialogue, self._name = dialogue, name

    def report(self, event: RobotEvent) -> None:
        """Report an event of the controller."""
        match event:
            case ErrorRecord(code=code, reason=reason):
                self._emit("fault", reason, code=code)
            case Contact(move=move):
                self._emit("contact", str(event), move=move)
            case str():
                self._emit("touch", event)

    def part(self, text: str, slips: bool) -> None:
        """Report that a part is gripped, released or gone; `slips` is True if the gripper lost it."""
        kind, level = ("part slips", logging.WARNING) if slips else ("part", logging.INFO)
        self._emit(kind, text, level=level)

    def _emit(self, kind: str, text: str, move: int = 0, code: int = 0, level: int = logging.WARNING) -> None:
        with log.named(self._name):
            logger.log(level, "%s", text, extra={"fields": {"kind": kind, "move": move, "code": code}})
        for listener in self.listeners:
            listener(kind, text, move, code)
        self._dialogue.event(ROBOT, f"{code} {text}" if code else text)
