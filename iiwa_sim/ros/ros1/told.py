"""What rospy says of itself, in our log: in one line each, and of floods the first. Needs no rospy."""

import logging
import time

from iiwa_sim.throttle import Throttle

MOST = 5
"""Of one kind, in a second."""
LETTERS = 40
"""Of a line by which its kind is told: behind them come addresses and names."""
LOGGERS = ("rosout", "rospy.internal")
"""By which rospy speaks of its connections."""

logger = logging.getLogger(__name__)


class RospyFilter(logging.Filter):
    """Makes one line of a traceback in words, its first and its last; holds back what recurs."""

    def __init__(self) -> None:
        super().__init__()
        self._throttle = Throttle[str](MOST, _more)

    def filter(self, record: logging.LogRecord) -> bool:
        lines = record.getMessage().strip().splitlines() or [""]
        record.msg = lines[0] if len(lines) == 1 else f"{lines[0]} {lines[-1]}"
        record.args = ()
        return self._throttle.count(record.msg[:LETTERS], time.monotonic_ns()) is not None


def shorten() -> None:
    """What rospy says from now on."""
    for name in LOGGERS:
        of_rospy = logging.getLogger(name)
        if not any(isinstance(each, RospyFilter) for each in of_rospy.filters):
            of_rospy.addFilter(RospyFilter())


def _more(begin: str, untold: int) -> None:
    logger.warning("rospy said %d more within that second that begin with '%s'", untold, begin)
