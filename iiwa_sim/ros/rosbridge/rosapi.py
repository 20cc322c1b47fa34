"""The introspection services for clients of rosbridge, in the words of ROS 1: those of the package rosapi."""

import msgspec

from iiwa_sim.ros.rmi.definitions import PRIMITIVES, full_text, parts, service
from iiwa_sim.ros.rmi.message_text import Definition, typedef
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, Node
from iiwa_sim.ros.rosbridge.introspection import KIND, Introspection, Row, Values

_TOLD = {name: (name, str(default)) for name, (_, default) in PRIMITIVES.items() if default is not None}
"""Name of each primitive type, and its default."""


class RosApi(Introspection):
    """Answers about one node. A call takes arguments as they come; KeyError names what does not exist."""

    def __init__(self, node: Node) -> None:
        own: dict[str, Row] = {
            "action_servers": ("GetActionServers", (), lambda _: {"action_servers": []}),
            "message_details": ("MessageDetails", KIND, lambda v: _details(node.definition(_kind(v)))),
            "service_request_details": (
                "ServiceRequestDetails",
                KIND,
                lambda v: _details(service(_kind(v)).request),
            ),
            "service_response_details": (
                "ServiceResponseDetails",
                KIND,
                lambda v: _details(service(_kind(v)).response),
            ),
            "get_time": ("GetTime", (), lambda _: {"time": node.time()}),
            "get_param": ("GetParam", ("name", "default"), _param),
        }
        published = {name: kind for name, (kind, _) in PUBLISHED.items()}

        def text_of(kind: str) -> str:
            return full_text(node.definition(kind))

        super().__init__(published, SUBSCRIBED, node.services, text_of, "rosapi", own)


def _kind(values: Values) -> str:
    return str(values.get("type", ""))


def _param(values: Values) -> Values:
    """There are no parameters: returns the default, which is JSON as the answer is, or null."""
    default = str(values.get("default", ""))
    try:
        msgspec.json.decode(default)
    except (msgspec.DecodeError, RecursionError):
        default = "null" if default == "" else msgspec.json.encode(default).decode()
    return {"value": default}


def _details(definition: Definition) -> Values:
    return {"typedefs": [typedef(part, _TOLD) for part in parts(definition)]}
