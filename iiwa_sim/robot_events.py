"""Events of the robot between commands, for the log, recordings and the dialogue."""

import logging
from collections.abc import Callable, Sequence

from iiwa_sim.controller.endings import Contact
from iiwa_sim.dialogue import Dialogue

ROBOT = "robot"
"""The name that the dialogue gives in place of a client's."""

logger = logging.getLogger(__name__)


class RobotEvents:
    """The events of one robot, as its controller tells them."""

    def __init__(self, dialogue: Dialogue) -> None:
        self.listeners: list[Callable[[str, str, int, int], None]] = []
        """Called with the kind and the text of an event, its move and its error code, 0 for none."""
        self._dialogue = dialogue

    def fault(self, code: int, reason: str) -> None:
        """Tell of an error that the controller meets between commands."""
        logger.warning("%s", reason, extra={"fields": {"code": code, "reason": reason}})
        self._tell("fault", reason, code=code)
        self._dialogue.event(ROBOT, f"{code} {reason}")

    def contact(self, contact: Contact) -> None:
        """Tell of the force that has ended a move."""
        logger.warning("%s", contact, extra={"fields": contact._asdict() | {"tcp": contact.tcp._asdict()}})
        self._tell("contact", str(contact), contact.move)
        self._dialogue.event(ROBOT, str(contact))

    def touch(self, told: str) -> None:
        """Tell which link begins to touch a surface or another link."""
        logger.warning("%s", told)
        self._tell("touch", told)
        self._dialogue.event(ROBOT, told)

    def part(self, told: str, slips: bool) -> None:
        """Tell that a part is gripped or let go, or is gone; `slips` for one that is lost by itself."""
        logger.log(logging.WARNING if slips else logging.INFO, "%s", told)
        self._tell("part slips" if slips else "part", told)
        self._dialogue.event(ROBOT, told)

    def _tell(self, kind: str, text: str, move: int = 0, code: int = 0) -> None:
        for listener in self.listeners:
            listener(kind, text, move, code)


def log_discarded(moves: Sequence[int], reason: str) -> None:
    """Log the moves, by number, that a stop or a change of mode has ended or dropped."""
    which = f"move {moves[0]}" if len(moves) == 1 else f"{len(moves)} moves, {moves[0]} to {moves[-1]}"
    extra = {"fields": {"moves": list(moves), "reason": reason}}
    logger.info("%s not carried out to the end: %s", which, reason, extra=extra)
