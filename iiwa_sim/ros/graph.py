"""The topics and services of one robot on ROS, whatever the transport, and questions about them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.messages import BadMessage, Message, checked, interface, short_name, time_of, to_ros1

NODE = "/iiwa_sim"
ROS_VERSION = "/rosapi/get_ros_version"

Content = Callable[[], Message]
Listener = Callable[[Message, int], None]
"""Takes a message of a topic and its number."""


@dataclass
class Topic:
    """A topic that the robot publishes. Types are named as in ROS 2."""

    kind: str
    rate_hz: int
    """Rate in simulated time; 0 for a topic that does not recur."""
    content: Content | None
    """Makes a message; None for a topic that is published when something happens."""
    in_ros1: bool = False
    """True if clients of ROS 1 know it, in their form."""
    seq: int = 0
    listeners: list[Listener] = field(default_factory=list)

    @property
    def is_latched(self) -> bool:
        """True if every subscriber gets one message, at once."""
        return self.content is not None and not self.rate_hz

    def publish(self, message: Message) -> None:
        """Tell all listeners a message."""
        for listener in list(self.listeners):
            listener(message, self.seq)
        self.seq = (self.seq + 1) % 2**32


@dataclass
class Served:
    """A topic that the robot subscribes to, or a service."""

    kind: str
    take: Callable[[Any], Any]
    """Takes a checked message; returns the response of a service."""
    in_ros1: bool = False


class Graph:
    """Topics and services by name, with a leading slash. Appendix A and the joint interface add theirs."""

    def __init__(self, controller: Controller, now_ns: Callable[[], int] | None) -> None:
        """`now_ns` returns the time that goes into headers (ns), by default simulated time."""
        self._controller = controller
        self._tick_rate_hz = round(1.0 / controller.tick_s)
        self.now_ns = now_ns or self.simulated_ns
        self.published: dict[str, Topic] = {}
        self.subscribed: dict[str, Served] = {}
        self.services: dict[str, Served] = {}
        self.actions: dict[str, str] = {}
        """Types of actions."""

    def simulated_ns(self) -> int:
        """Return the simulated time (ns)."""
        return round(1e9 * self._controller.tick * self._controller.tick_s)

    def is_due(self, rate_hz: int) -> bool:
        """Return whether something that recurs at a rate (Hz of simulated time) is due in this tick."""
        tick = self._controller.tick
        return tick * rate_hz // self._tick_rate_hz > (tick - 1) * rate_hz // self._tick_rate_hz

    @property
    def stamp(self) -> dict[str, int]:
        """The time that goes into headers."""
        return time_of(self.now_ns())

    def header(self, frame: str = "") -> Message:
        """A header as of now."""
        return {"stamp": self.stamp, "frame_id": frame}

    @property
    def watching(self) -> bool:
        """True if a tick may publish something that somebody hears."""
        return any(topic.listeners and topic.rate_hz for topic in self.published.values())

    def listen(self, name: str, listener: Listener) -> Callable[[], None]:
        """Register a listener for a topic; return what ends that."""
        topic = self.published[name]
        topic.listeners.append(listener)
        if topic.is_latched:
            assert topic.content is not None
            listener(topic.content(), 0)
        return partial(topic.listeners.remove, listener)

    def receive(self, name: str, content: Any) -> None:
        """Take a message for a topic of `subscribed`. Raises BadMessage, and then nothing of it is done."""
        topic = self.subscribed[name]
        try:
            topic.take(checked(content, topic.kind))
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            raise BadMessage(refused.reason) from None

    def call(self, name: str, request: Any) -> Message:
        """Call a service; return the response. Raises BadMessage."""
        service = self.services[name]
        response: Message = service.take(checked(request, service.kind, "srv"))
        return response

    def step(self) -> None:
        """Notice that a tick has been made: publish what is due."""
        for topic in self.published.values():
            if topic.listeners and topic.content is not None and self.is_due(topic.rate_hz):
                topic.publish(topic.content())


class RosApi:
    """Answers questions about a graph, as the services of the package rosapi do in ROS 1 and ROS 2.

    https://github.com/RobotWebTools/rosbridge_suite/tree/ros2/rosapi
    """

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._answers: dict[str, Callable[[str, bool], Message]] = {
            "topics": lambda _, ros2: _listed(self._topics(ros2)),
            "topic_type": lambda name, ros2: {"type": self._topics(ros2).get(rooted(name), "")},
            "topics_for_type": lambda kind, ros2: {"topics": _of(self._topics(ros2), kind)},
            "services": lambda _, ros2: {"services": [*self._services(ros2), *self.services]},
            "service_type": lambda name, ros2: {"type": self._services(ros2).get(rooted(name), "")},
            "services_for_type": lambda kind, ros2: {"services": _of(self._services(ros2), kind)},
            "nodes": lambda _, __: {"nodes": [NODE]},
            "message_details": lambda kind, _: _details(kind, "msg", 0),
            "service_request_details": lambda kind, _: _details(kind, "srv", 0),
            "service_response_details": lambda kind, _: _details(kind, "srv", 1),
            "action_servers": lambda _, __: {"action_servers": list(graph.actions)},
            "get_time": lambda _, ros2: {"time": graph.stamp if ros2 else to_ros1(graph.stamp)},
            "get_ros_version": lambda _, __: {"version": 2, "distro": ""},
        }
        self.services = [f"/rosapi/{name}" for name in self._answers]

    def answer(self, service: str, arguments: Any, ros2: bool) -> Message:
        """Return a response. Raises KeyError with the name of a service or type that does not exist."""
        if service not in self.services:
            raise KeyError(service)
        return self._answers[service.removeprefix("/rosapi/")](argument_of(arguments), ros2)

    def _topics(self, ros2: bool) -> dict[str, str]:
        return {**_told(self._graph.published, ros2), **_told(self._graph.subscribed, ros2)}

    def _services(self, ros2: bool) -> dict[str, str]:
        return _told(self._graph.services, ros2)


def rooted(name: str) -> str:
    """Return a name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


def argument_of(arguments: Any) -> str:
    """Return the first argument of a call: no service of rosapi here needs another."""
    values = [*arguments.values()] if isinstance(arguments, dict) else arguments
    return values[0] if isinstance(values, list) and values and isinstance(values[0], str) else ""


def _told(named: Mapping[str, Topic] | Mapping[str, Served], ros2: bool) -> dict[str, str]:
    """The types by name, as a client of that ROS knows them."""
    shown = {name: each for name, each in named.items() if ros2 or each.in_ros1}
    return {name: each.kind if ros2 else short_name(each.kind) for name, each in shown.items()}


def _listed(topics: dict[str, str]) -> Message:
    return {"topics": list(topics), "types": list(topics.values())}


def _of(types: dict[str, str], wanted: str) -> list[str]:
    return [name for name, kind in types.items() if kind == wanted]


def _details(name: str, kind: str, part: int) -> Message:
    return {"typedefs": interface(name, kind)[part].details}
