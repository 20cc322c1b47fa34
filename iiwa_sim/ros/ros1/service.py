"""A service of ROS 1 that tolerates callers that vanish. Needs rospy."""

import contextlib
import logging
from types import TracebackType
from typing import Any

import rospy

READ_BYTES = 1024
"""Bytes read at once from a caller or publisher. All messages in them, a hundred of the smallest, are
parsed without a break in a thread beside the loop."""

logger = logging.getLogger(__name__)


class Service(rospy.Service):  # type: ignore[misc]  # rospy has no types
    """rospy.Service, for which a caller that vanishes before its answer is no error with tracebacks."""

    def __init__(self, name: str, kind: type, called: Any) -> None:
        super().__init__(name, kind, called, buff_size=READ_BYTES, error_handler=self._failed)

    def _failed(
        self, fault: Exception, kind: type[Exception], _value: Exception, traceback: TracebackType
    ) -> None:
        if isinstance(fault, OSError):  # of the connection: our part raises ServiceException
            logger.info("a caller of %s has gone before its answer", self.resolved_name)
        else:
            logger.error("internal error in %s", self.resolved_name, exc_info=(kind, fault, traceback))

    def _write_service_error(self, transport: Any, reason: str) -> None:
        with contextlib.suppress(OSError):  # gone
            super()._write_service_error(transport, reason)
