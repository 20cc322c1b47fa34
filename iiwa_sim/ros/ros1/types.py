"""Message classes for ROS 1 that genpy makes of our definitions, and their conversion to plain messages.

Needs genpy, which comes with rospy.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from genpy import Time
from genpy.dynamic import generate_dynamic

from iiwa_sim.ros.rmi.definitions import full_text, message, service, service_md5
from iiwa_sim.ros.rmi.message_text import Definition, Field


class Types:
    """The classes for topics, and for services by the name of their type (package/Type)."""

    def __init__(self, messages: Iterable[Definition], services: Iterable[str]) -> None:
        called = [service(name) for name in services]
        halves = [half for each in called for half in (each.request, each.response)]
        self._made = _generated([*messages, *halves])
        self.services = {each.name: self._service(each.name) for each in called}
        """Services in the form that rospy expects."""

    def message(self, name: str) -> Any:
        """The class of a published message."""
        return self._made[name]

    def heard(self, name: str) -> Any:
        """A class for received messages that keeps the bytes. rospy would parse them at once, in a thread
        of its own, and log tracebacks for malformed ones, or for services nothing."""
        made = self._made[name]

        def deserialize(self: Any, data: bytes) -> Any:
            self.data = data
            return self

        return type(made.__name__, (made,), {"data": b"", "deserialize": deserialize})

    def filled(self, definition: Definition, content: dict[str, Any]) -> Any:
        """A message of these contents; missing fields get the defaults of ROS."""
        given = {
            field.name: self._value(field, content[field.name])
            for field in definition.fields
            if field.name in content
        }
        return self._made[definition.name](**given)

    def _value(self, field: Field, value: Any) -> Any:
        if field.type == "time":
            return Time(value["secs"], value["nsecs"])
        if field.type not in self._made:
            return value
        definition = message(field.type)
        if field.is_list:
            return [self.filled(definition, each) for each in value]
        return self.filled(definition, value)

    def _service(self, name: str) -> Any:
        members = {
            "_type": name,
            "_md5sum": service_md5(name),
            "_request_class": self.heard(f"{name}Request"),
            "_response_class": self._made[f"{name}Response"],
        }
        return type(name.split("/")[1], (), members)


def _generated(definitions: Sequence[Definition]) -> dict[str, Any]:
    """A class for each definition and for the messages in it."""
    made: dict[str, Any] = generate_dynamic(definitions[0].name, full_text(*definitions))
    return made
