"""What one client of rosbridge hears in the form of ROS 1: its subscriptions, several to a topic."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from iiwa_sim.ros.rmi.node import COMMAND_RESULT, PUBLISHED, Message, Node
from iiwa_sim.ros.rosbridge.encodings import COMPRESSIONS, encoded_once
from iiwa_sim.ros.rosbridge.fields import Misuse, check_whole, compression_of, key_of, number_of
from iiwa_sim.ros.rosbridge.outbox import LONGEST_FEED, Outbox

MOST_SUBSCRIPTIONS = 1000
"""Subscriptions of one client to one topic, which are told apart by their ids."""


class _Wish(NamedTuple):
    """The options of one subscription."""

    throttle_s: float
    queue_length: int
    compression: str


@dataclass
class _Subscribed:
    """A topic with the subscriptions of the client."""

    hear: Callable[[Message], None]
    wishes: dict[Any, _Wish]
    """Options by the ids of the subscriptions."""
    compression: str = COMPRESSIONS[0]
    """The most demanding compression of the subscriptions."""


class Subscriptions:
    """The topics that a client is subscribed to, which come by its outbox."""

    def __init__(self, node: Node, outbox: Outbox) -> None:
        self._node = node
        self._outbox = outbox
        self._subscribed: dict[str, _Subscribed] = {}

    def add(self, topic: str, message: Message) -> None:
        """Subscribe to a topic of the node, as an operation `subscribe` asks. Raises Misuse."""
        wish = _Wish(
            throttle_s=1e-3 * number_of(message, "throttle_rate"),
            queue_length=int(number_of(message, "queue_length")),
            compression=compression_of(message, COMPRESSIONS),
        )
        check_whole(message)
        key = key_of(message)
        if topic not in self._subscribed:
            self._subscribed[topic] = subscribed = self._listened_to(topic, message["topic"])
            self._node.listen(topic, subscribed.hear)
        wishes = self._subscribed[topic].wishes
        if key not in wishes and len(wishes) >= MOST_SUBSCRIPTIONS:
            raise Misuse(f"{topic} is subscribed to {MOST_SUBSCRIPTIONS} times: expected no more")
        wishes[key] = wish
        self._set_feed(topic)

    def remove(self, topic: str, message: Message) -> None:
        """End the subscription of an operation `unsubscribe`, or all to the topic where it has no id. Raises
        Misuse."""
        if topic not in self._subscribed:
            raise Misuse(f"{topic} is not subscribed to")
        wishes = self._subscribed[topic].wishes
        if "id" in message:
            wishes.pop(key_of(message), None)
        else:
            wishes.clear()
        if wishes:
            self._set_feed(topic)
        else:
            self._end_feed(topic)

    def end(self) -> None:
        """End all of them: the client has gone."""
        for topic in list(self._subscribed):
            self._end_feed(topic)

    def _listened_to(self, topic: str, name: str) -> _Subscribed:
        """A topic without subscriptions; `name` is as the client writes it, by which it tells topics
        apart."""
        kind, now = PUBLISHED[topic][0], self._node.time

        def hear(content: Message) -> None:  # runs in the tick for each client, so it has to be cheap
            self._outbox.feed(topic, partial(encoded_once, subscribed.compression, name, kind, content, now))

        subscribed = _Subscribed(hear, {})
        return subscribed

    def _set_feed(self, topic: str) -> None:
        """Combine several subscriptions: the most demanding options count. Results wait until they are
        sent."""
        wishes = self._subscribed[topic].wishes.values()
        self._subscribed[topic].compression = max(
            (each.compression for each in wishes), key=COMPRESSIONS.index
        )
        queue_length = LONGEST_FEED if topic == COMMAND_RESULT else max(each.queue_length for each in wishes)
        self._outbox.set_feed(topic, min(each.throttle_s for each in wishes), queue_length)

    def _end_feed(self, topic: str) -> None:
        self._node.unlisten(topic, self._subscribed.pop(topic).hear)
        self._outbox.end_feed(topic)
