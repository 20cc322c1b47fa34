"""Faults of ours in ticks: told with where they came from, and counted where they recur."""

import logging
import traceback

from iiwa_sim.throttle import Throttle

Place = tuple[str, str, int | None]
"""The place of a fault: its type, and the file and line that raised it."""

logger = logging.getLogger(__name__)


class TickFaults:
    """Which faults of ticks are to be told: each place once in a second, and after that how often."""

    def __init__(self) -> None:
        self._throttle = Throttle[Place](1, _failed_more)

    def to_be_told(self, fault: Exception, now_ns: int) -> bool:
        """Whether a fault that was raised at this time is the first of its place within a second."""
        where = traceback.extract_tb(fault.__traceback__)[-1]
        place = type(fault).__name__, where.filename, where.lineno
        return self._throttle.count(place, now_ns) is not None


def _failed_more(place: Place, untold: int) -> None:
    logger.error("%d more internal errors in ticks within that second: %s in %s, line %s", untold, *place)
