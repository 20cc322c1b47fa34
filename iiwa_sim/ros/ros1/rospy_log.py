"""Log messages of rospy in our log: one line each, and only the first of a flood. Does not need rospy."""

import logging
import time

from iiwa_sim.throttle import Throttle

MOST = 5
"""Messages of one kind per second."""
LETTERS = 40
"""Letters that identify the kind of a message: addresses and names come after them."""
LOGGERS = ("rosout", "rospy.internal")
"""The loggers of rospy for its connections."""

logger = logging.getLogger(__name__)


class RospyFilter(logging.Filter):
    """Shortens a traceback to its first and last line; suppresses repeated messages."""

    def __init__(self) -> None:
        super().__init__()
        self._throttle = Throttle[str](MOST, _more)

    def filter(self, record: logging.LogRecord) -> bool:
        lines = record.getMessage().strip().splitlines() or [""]
        record.msg = lines[0] if len(lines) == 1 else f"{lines[0]} {lines[-1]}"
        record.args = ()
        return self._throttle.count(record.msg[:LETTERS], time.monotonic_ns()) is not None


def shorten() -> None:
    """Install the filter on rospy's loggers."""
    for name in LOGGERS:
        of_rospy = logging.getLogger(name)
        if not any(isinstance(each, RospyFilter) for each in of_rospy.filters):
            of_rospy.addFilter(RospyFilter())


def _more(begin: str, untold: int) -> None:
    logger.warning("rospy said %d more within that second that begin with '%s'", untold, begin)
