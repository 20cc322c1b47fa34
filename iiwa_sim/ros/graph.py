"""The topics and services of one robot on ROS, whatever the transport."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.messages import BadMessage, Message, checked, time_of

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
    def recurs(self) -> bool:
        """True if a message may be left out, since the next one says it anew."""
        return self.rate_hz > 0

    @property
    def is_latched(self) -> bool:
        """True if every subscriber gets one message, at once."""
        return self.content is not None and not self.recurs

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

    def __init__(self, controller: Controller, now_ns: Callable[[], int]) -> None:
        """`now_ns` returns the time that goes into headers (ns)."""
        self._controller = controller
        self._tick_rate_hz = round(1.0 / controller.tick_s)
        self.now_ns = now_ns
        self.published: dict[str, Topic] = {}
        self.subscribed: dict[str, Served] = {}
        self.services: dict[str, Served] = {}

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
        return any(topic.listeners and topic.recurs for topic in self.published.values())

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
