"""The node of ROS 1: it relays topics and services of iiwa-sim by rospy."""

from __future__ import annotations

import logging
import os
import sys
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import genpy
import rosgraph
import rospy
from genpy.message import fill_message_args, get_message_class, get_service_class

from .pipe import Fault, Pipe, shortest

RESULTS = "/command_result"
STATES_WAIT, RESULTS_WAIT = 10, 1000
"""Messages of a topic kept for a slow subscriber."""


def serve(pipe: Pipe, config: dict[str, Any]) -> None:
    """Be a node until standard input ends. Raises Fault."""
    for package in ("sensor_msgs.msg", "std_srvs.srv"):
        import_module(package)  # so that a clear message names it where it lacks
    logging.basicConfig(level=logging.WARNING, format="%(message)s")
    master = str(rosgraph.get_master_uri(argv=[])).rstrip("/")
    try:
        if not rosgraph.is_master_online(master):
            raise Fault(f"no ROS master at {master[:80]}: start one (roscore), or set ROS_MASTER_URI")
        # Without a logging file of its own, rospy takes one that replaces all handlers and writes files.
        os.environ["ROS_PYTHON_LOG_CONFIG_FILE"] = str(Path(__file__).with_name("ros1_logging.yaml"))
        quiet = {"disable_signals": True, "disable_rosout": True, "disable_rostime": True}
        rospy.init_node(config["node"], argv=[], **quiet)
        relay = Relay(pipe, config)
    except (OSError, rosgraph.MasterException, rospy.ROSException, ValueError) as fault:
        raise Fault(f"no ROS node with the master at {master[:80]}: {fault}") from None
    pipe.say("ready", node=master)
    for topic, _, recurs, _ in config["publish"]:
        if not recurs:
            pipe.say("subscribe", topic=topic)
    try:
        pipe.read(relay.take)
    finally:
        rospy.signal_shutdown("the robot ends")


class Relay(rospy.SubscribeListener):  # type: ignore[misc]  # rospy has no types
    """Topics and services of the node at its master."""

    def __init__(self, pipe: Pipe, config: dict[str, Any]) -> None:
        super().__init__()
        self._pipe = pipe
        # Behind others: types that are installed come first, but for that of results.
        sys.path.extend(str(each) for each in Path(config["packages"]).glob("*/src"))
        result = _result_class(config["result_constants"])
        self._publishers = {
            topic: rospy.Publisher(
                topic,
                result if topic == RESULTS else get_message_class(kind),
                subscriber_listener=self if recurs else None,
                tcp_nodelay=True,
                queue_size=STATES_WAIT if recurs else RESULTS_WAIT,
            )
            for topic, kind, recurs, _ in config["publish"]
        }
        for service, kind in config["serve"]:
            made = get_service_class(kind)
            rospy.Service(service, made, partial(self._serve, service, made))
        for topic, kind in config["subscribe"]:
            rospy.Subscriber(topic, get_message_class(kind), self._publish, topic, tcp_nodelay=True)

    def peer_subscribe(self, topic: str, _publish: Any, _peer_publish: Any) -> None:
        """Notice that a client subscribes to a topic."""
        self._pipe.say("subscribe", topic=topic)

    def peer_unsubscribe(self, topic: str, count: int) -> None:
        """Notice that a subscriber has gone."""
        if not count:
            self._pipe.say("unsubscribe", topic=topic)

    def take(self, message: dict[str, Any]) -> None:
        """Publish a message that comes from iiwa-sim."""
        if message["op"] == "publish" and not rospy.is_shutdown():
            publisher = self._publishers[message["topic"]]
            publisher.publish(_filled(publisher.data_class(), message["msg"]))

    def _publish(self, message: Any, topic: str) -> None:
        self._pipe.say("publish", topic=topic, msg=_plain(message))

    def _serve(self, name: str, made: Any, request: Any) -> Any:
        values, fault = self._pipe.call(name, _plain(request))
        if fault:
            raise rospy.ServiceException(fault)
        return _filled(made._response_class(), values)


def _result_class(constants: int) -> Any:
    """Return the class of the message Result with so many constants, which its MD5 sum covers."""
    generated = import_module("iiwa_sim_msgs.generated")
    name, texts = "robot_movement_interface/Result", generated.texts("msg")
    lines = texts[name].splitlines(keepends=True)
    later = [line for line in lines if "=" in line][constants:]
    texts[name] = "".join(line for line in lines if line not in later)
    return generated.classes_of(texts, [name])[name]


def _filled(message: Any, values: dict[str, Any]) -> Any:
    fill_message_args(message, [values])
    return message


def _plain(value: Any, kind: str = "") -> Any:
    """Return a message as dicts, lists and numbers; `kind` is its type, where that is no message."""
    if isinstance(value, genpy.Message):
        names = zip(value.__slots__, value._slot_types)  # noqa: B905  # Python 3.8 of ROS 1 knows no strict
        return {name: _plain(getattr(value, name), each) for name, each in names}
    if isinstance(value, genpy.TVal):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, (list, tuple)):
        return [_plain(each, kind.partition("[")[0]) for each in value]
    return shortest(value) if kind == "float32" else value
