"""Registration of the node at its ROS master, also at one that restarts. Needs rospy."""

import http.client
import logging
import os
import tempfile
import threading
import xmlrpc.client
from collections.abc import Sequence
from typing import Any

import rosgraph
import rospy

from iiwa_sim.ros.ros1.rospy_log import shorten

EVERY_S = 2.0
"""Seconds between two checks; each is one short call."""

FAULTS = (OSError, rosgraph.MasterException, http.client.HTTPException, xmlrpc.client.Error)

logger = logging.getLogger(__name__)


def start_node(name: str) -> None:
    """rospy.init_node, without rospy's signal handlers and log files."""
    logging.getLogger("rospy").setLevel(logging.WARNING)
    shorten()
    # Without a logging file of its own, rospy takes one that replaces all handlers of the process.
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as nothing_new:
        nothing_new.write("{version: 1, incremental: true}\n")
        nothing_new.flush()
        previous = os.environ.get("ROS_PYTHON_LOG_CONFIG_FILE")
        os.environ["ROS_PYTHON_LOG_CONFIG_FILE"] = nothing_new.name
        try:
            rospy.init_node(name, argv=[], disable_signals=True, disable_rosout=True, disable_rostime=True)
        finally:
            if previous is None:
                del os.environ["ROS_PYTHON_LOG_CONFIG_FILE"]
            else:
                os.environ["ROS_PYTHON_LOG_CONFIG_FILE"] = previous


class MasterWatch:
    """Keeps a node registered at the master until `end`, also after a restart of the master."""

    def __init__(self, handles: Sequence[Any]) -> None:
        """`handles` are rospy's publishers, subscribers and services."""
        self._handles = handles
        self._ended = threading.Event()
        self._registering = threading.Lock()
        self._answers = True
        # a daemon thread, since a hanging master may block it for ever
        threading.Thread(target=self._go_on, name="ros-master-watch", daemon=True).start()

    def end(self) -> None:
        """Stop registering; waits for a registration in progress."""
        self._ended.set()
        with self._registering:
            pass

    def _go_on(self) -> None:
        while not self._ended.wait(EVERY_S) and not rospy.is_shutdown():
            try:
                self._look()
            except (
                OSError,
                rosgraph.MasterException,
                http.client.HTTPException,
                xmlrpc.client.Error,
            ) as fault:
                if self._answers:
                    logger.warning(
                        "the ROS master does not answer: new nodes do not find this one (%s)", fault
                    )
                self._answers = False
            else:
                if not self._answers:
                    logger.warning("the ROS master answers again")
                self._answers = True

    def _look(self) -> None:
        master = rosgraph.Master(rospy.get_name())
        try:
            master.lookupNode(rospy.get_name())
        except rosgraph.MasterError:  # the master knows no such node
            with self._registering:
                if not (self._ended.is_set() or rospy.is_shutdown()):
                    self._register(master)
                    logger.warning("the ROS master no longer knew this node: it has registered again")

    def _register(self, master: Any) -> None:
        uri = rospy.get_node_uri()
        for handle in self._handles:
            name = handle.resolved_name
            if isinstance(handle, rospy.Service):
                master.registerService(name, handle.uri, uri)
            elif isinstance(handle, rospy.Publisher):
                master.registerPublisher(name, handle.type, uri)
            else:
                publishers = master.registerSubscriber(name, handle.type, uri)
                # the same call by which the master announces new publishers
                with xmlrpc.client.ServerProxy(uri) as ourselves:
                    ourselves.publisherUpdate("/master", name, publishers)
