"""The topics and services of one robot on ROS, whatever the transport, and questions about them."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.messages import BadMessage, Message, checked, short_name, time_of, to_ros1
from iiwa_sim.wording import harmless, shortened

NODE = "/iiwa_sim"
ROS_VERSION = "/rosapi/get_ros_version"

Listener = Callable[[Message], None]


@dataclass
class Topic:
    """A topic that the robot publishes. Types are named as in ROS 2."""

    kind: str
    rate_hz: int
    """Rate in simulated time; 0 for a topic that does not recur."""
    content: Callable[[], Message] | None
    """Makes a message; None for a topic that is published when something happens."""
    in_ros1: bool = False
    """True if clients of ROS 1 know it, in their form."""
    listeners: list[Listener] = field(default_factory=list)

    @property
    def is_latched(self) -> bool:
        """True if every subscriber gets one message, at once."""
        return self.content is not None and not self.rate_hz

    def publish(self, message: Message) -> None:
        """Pass a message to all listeners."""
        for listener in list(self.listeners):
            listener(message)


@dataclass
class Endpoint:
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
        self.subscribed: dict[str, Endpoint] = {}
        self.services: dict[str, Endpoint] = {}
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
        """Return a header as of now."""
        return {"stamp": self.stamp, "frame_id": frame}

    @property
    def watching(self) -> bool:
        """True if a tick may publish on a topic with listeners."""
        return any(topic.listeners and topic.rate_hz for topic in self.published.values())

    def listen(self, name: str, listener: Listener) -> Callable[[], None]:
        """Register a listener for a topic; return the function that removes it."""
        topic = self.published[name]
        topic.listeners.append(listener)
        if topic.content is not None and topic.is_latched:
            listener(topic.content())
        return partial(topic.listeners.remove, listener)

    def receive(self, name: str, content: Any) -> None:
        """Handle a message for a topic of `subscribed`. If it raises BadMessage, nothing of it is done."""
        topic = self.subscribed[name]
        with self.recording():
            topic.take(checked(content, topic.kind))

    @contextmanager
    def recording(self) -> Iterator[None]:
        """Record a refusal as the last error of the robot, and raise it as BadMessage."""
        try:
            yield
        except Refused as refused:
            self._controller.errors.record(refused.code, refused.reason)
            raise BadMessage(refused.reason) from None

    def call(self, name: str, request: Any) -> Any:
        """Call a service; return the response. Raises BadMessage."""
        service = self.services[name]
        with self.recording():
            return service.take(checked(request, service.kind))

    def step(self) -> None:
        """Notice that a tick has been made: publish the messages that are due."""
        for topic in self.published.values():
            if topic.listeners and topic.content is not None and self.is_due(topic.rate_hz):
                topic.publish(topic.content())


def rosapi(graph: Graph, service: str, argument: str, ros2: bool) -> Message:
    """Answer a question about a graph, as the package rosapi of rosbridge_suite. Raises BadMessage."""
    topics = types_of({**graph.published, **graph.subscribed}, ros2)
    services = types_of(graph.services, ros2)
    answers: dict[str, Message] = {
        "/rosapi/topics": {"topics": list(topics), "types": list(topics.values())},
        "/rosapi/topic_type": {"type": topics.get(rooted(argument), "")},
        "/rosapi/topics_for_type": {"topics": [each for each in topics if topics[each] == argument]},
        "/rosapi/services": {"services": list(services)},
        "/rosapi/service_type": {"type": services.get(rooted(argument), "")},
        "/rosapi/services_for_type": {"services": [each for each in services if services[each] == argument]},
        "/rosapi/nodes": {"nodes": [NODE]},
        "/rosapi/action_servers": {"action_servers": list(graph.actions)},
        "/rosapi/get_time": {"time": graph.stamp if ros2 else to_ros1(graph.stamp)},
        ROS_VERSION: {"version": 2, "distro": ""},
    }
    if service not in answers:
        raise BadMessage(f"there is no {shortened(harmless(service), 200)}")
    return answers[service]


def rooted(name: str) -> str:
    """Return a name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


def types_of(named: Mapping[str, Topic | Endpoint], ros2: bool) -> dict[str, str]:
    """Return the types of topics or services by name, as ROS 1 or ROS 2 knows them."""
    shown = {name: each.kind for name, each in named.items() if ros2 or each.in_ros1}
    return shown if ros2 else {name: short_name(kind) for name, kind in shown.items()}
