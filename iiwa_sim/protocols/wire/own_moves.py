"""The moves of one connection, and what becomes of the robot when that connection goes."""

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.protocols.wire.log import ProtocolLog


class OwnMoves(set[int]):
    """Moves of one connection, by number, that have not ended."""

    def has_ended(self, ending: Ending) -> None:
        """Notice that a move has ended; the controller is given this with each of them."""
        self.discard(ending.move)

    def abandon(self, controller: Controller, log: ProtocolLog, session: str) -> None:
        """Notice that the connection has vanished: stop the robot if one of its moves runs or waits."""
        if self:
            controller.stop()
            log.stopped(session, vanished=True)
