"""A robot as a ROS node without a transport: its topics and services, as plain messages.

Transports register listeners for topics, pass in messages and calls, and name things as ROS does, with a
slash.
"""

from collections.abc import Callable, Mapping
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.conventions import APPLY, NEWEST_RESULT
from iiwa_sim.ros.rmi.command_queue import CommandQueue, Result
from iiwa_sim.ros.rmi.definitions import RESULT, message, result_message, service, type_of
from iiwa_sim.ros.rmi.message_text import Definition, converted
from iiwa_sim.ros.rmi.pins import Pins
from iiwa_sim.ros.rmi.rates import Rates
from iiwa_sim.ros.rmi.robot import Robot
from iiwa_sim.ros.rmi.services import Services

Message = dict[str, Any]
Listener = Callable[[Message], None]

COMMAND_LIST = "/command_list"
COMMAND_RESULT = "/command_result"
ROBOT_STATUS = "/robot_status"

PUBLISHED: Mapping[str, tuple[str, int]] = {
    COMMAND_RESULT: (RESULT, 0),  # published on change, not periodically
    ROBOT_STATUS: ("industrial_msgs/RobotStatus", 50),
    "/tool_frame": ("robot_movement_interface/EulerFrame", 100),
    "/joint_states": ("sensor_msgs/JointState", 100),
    "/current_speed_scale": ("std_msgs/Float32", 10),
    "/io_states": ("robot_movement_interface/IOStates", 10),
}
"""Type of each topic, and its rate in Hz of simulated time."""
SUBSCRIBED: Mapping[str, str] = {COMMAND_LIST: "robot_movement_interface/CommandList"}
"""Type of each topic that the node subscribes to."""


class Node:
    """The topics and services of one robot."""

    def __init__(
        self,
        controller: Controller,
        now_ns: Callable[[], int],
        tick_rate_hz: int,
        log: ProtocolLog,
        result: int = NEWEST_RESULT,
        reference: str = APPLY,
    ) -> None:
        """`now_ns` returns the time since 1970 (ns) that goes into headers; for `result` and `reference` see
        `conventions.py`."""
        self._controller = controller
        self._now_ns = now_ns
        self._result = result
        self._queue = CommandQueue(
            Robot(controller), self._publish_result, log, apply_reference=reference == APPLY
        )
        self._services = Services(controller, self._queue, self.time).all
        self._listeners: dict[str, list[Listener]] = {name: [] for name in PUBLISHED}
        self._rates = Rates({topic: rate_hz for topic, (_, rate_hz) in PUBLISHED.items()}, tick_rate_hz)
        self._sequence = dict.fromkeys(PUBLISHED, 0)
        self.services: Mapping[str, str] = {name: kind for name, (kind, _) in self._services.items()}
        """Type of each service, by name."""

    @property
    def has_commands(self) -> bool:
        """Whether the next ticks will send a command to the robot or publish a result."""
        return self._queue.is_active

    @property
    def watching(self) -> bool:
        """Whether a tick may do anything: a topic that recurs is heard, or a command has no result yet."""
        return not self._queue.empty or any(self._listeners[topic] for topic in self._rates.names)

    def definition(self, name: str) -> Definition:
        """The definition of the message package/Type that this node uses. Raises KeyError for others."""
        return result_message(self._result) if name == RESULT else message(name)

    def time(self) -> dict[str, int]:
        """The time that goes into headers, as ROS 1 has it."""
        secs, nsecs = divmod(self._now_ns(), 1_000_000_000)
        return {"secs": secs, "nsecs": nsecs}

    def listen(self, topic: str, listener: Listener) -> None:
        """Register a listener for a topic of `PUBLISHED`."""
        self._listeners[topic].append(listener)

    def unlisten(self, topic: str, listener: Listener) -> None:
        """Remove a listener."""
        self._listeners[topic].remove(listener)

    def receive(self, topic: str, content: Any) -> None:
        """Take a message for a topic of `SUBSCRIBED`. Raises `BadMessage`, and then nothing of it is done."""
        taken: Any = converted(content, type_of(message(SUBSCRIBED[topic])))
        self._queue.take(taken.commands, replace=taken.replace_previous_commands)

    def call(self, name: str, request: Any) -> Message:
        """Call a service of `services`; gives the response. Raises `BadMessage`."""
        kind, call = self._services[name]
        return call(converted(request, type_of(service(kind).request)))

    def step(self) -> None:
        """Notice that a tick has been made."""
        self._queue.step()
        for topic in self._rates.due():
            if self._listeners[topic]:
                self._publish(topic, self._content(topic))

    def skip(self, ticks: int) -> None:
        """The robot has made `ticks` ticks while the node was not `watching`."""
        self._rates.skip(ticks)

    def _publish(self, topic: str, content: Message) -> None:
        for listener in list(self._listeners[topic]):
            listener(content)

    def _publish_result(self, result: Result) -> None:
        if not self._listeners[COMMAND_RESULT]:
            return
        content = {
            "header": self._header(COMMAND_RESULT),
            "command_id": result.command_id,
            "result_code": result.code,
            "additional_information": result.information,
        }
        self._publish(COMMAND_RESULT, content)

    def _status(self) -> Message:
        status = self._controller.status()
        *flags, code = status
        values = {name: {"val": flag} for name, flag in zip(status._fields[:-1], flags, strict=True)}
        return {"header": self._header(ROBOT_STATUS), **values, "error_code": code}

    def _content(self, topic: str) -> Message:
        """The message for a topic that recurs."""
        controller = self._controller
        if topic == ROBOT_STATUS:
            return self._status()
        if topic == "/joint_states":
            return {
                "header": self._header(topic),
                "name": list(controller.description.joints),
                "position": list(controller.joints),
                "velocity": list(controller.joint_velocity()),
                "effort": [],
            }
        if topic == "/tool_frame":
            x_mm, y_mm, z_mm, alpha, beta, gamma = controller.tool_frame()
            places = {"x": 1e-3 * x_mm, "y": 1e-3 * y_mm, "z": 1e-3 * z_mm}
            return {**places, "alpha": alpha, "beta": beta, "gamma": gamma}
        if topic == "/current_speed_scale":
            return {"data": controller.override}
        inputs, outputs = (
            [{"pin_number": number, "pin_value": value} for number, value in row]
            for row in Pins.of(controller.io).numbered()
        )
        return {"inputs": inputs, "outputs": outputs}

    def _header(self, topic: str) -> Message:
        sequence = self._sequence[topic]
        self._sequence[topic] = (sequence + 1) % 2**32
        return {"seq": sequence, "stamp": self.time(), "frame_id": ""}
