"""A robot as a ROS node without a transport: its topics and services, as plain messages.

Transports register listeners for topics, pass in messages and calls, and name things as ROS does, with a
slash.
"""

from collections.abc import Callable, Mapping
from typing import Any

from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.ros.conventions import TODAYS, Conventions
from iiwa_sim.ros.rmi.command_queue import CommandQueue, Result
from iiwa_sim.ros.rmi.definitions import RESULT, message, result_message, service, type_of
from iiwa_sim.ros.rmi.message_text import Definition, converted
from iiwa_sim.ros.rmi.pins import Pins
from iiwa_sim.ros.rmi.rates import Rates
from iiwa_sim.ros.rmi.robot import Failure, Robot, State
from iiwa_sim.ros.rmi.services import Answer, Fail, Services

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
        robot: Robot,
        now_ns: Callable[[], int],
        tick_rate_hz: int,
        log: DialectLog,
        conventions: Conventions = TODAYS,
    ) -> None:
        """`now_ns` returns the time since 1970 (ns) that goes into headers."""
        self._robot = robot
        self._now_ns = now_ns
        self._result_type = conventions.result
        self._queue = CommandQueue(robot, self._publish_result, log, conventions.reference)
        self._services = Services(robot, self._queue, self.time).all
        self._listeners: dict[str, list[Listener]] = {name: [] for name in PUBLISHED}
        usual = {topic: rate_hz for topic, (_, rate_hz) in PUBLISHED.items()}
        self.rates = Rates(conventions.rates(usual), tick_rate_hz)
        """The rates of the topics that recur."""
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
        return not self._queue.empty or any(self._listeners[topic] for topic in self.rates.rates_hz)

    def definition(self, name: str) -> Definition:
        """The definition of the message package/Type that this node uses. Raises KeyError for others."""
        return result_message(self._result_type) if name == RESULT else message(name)

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

    def call(self, name: str, request: Any, answer: Answer, fail: Fail) -> None:
        """Call a service of `services`; either `answer` or `fail` is called once, now or later.

        Raises `BadMessage`.
        """
        kind, call = self._services[name]
        call(converted(request, type_of(service(kind).request)), answer, fail)

    def step(self) -> None:
        """Notice that a tick has been made."""
        self._queue.step()
        state: State | None = None
        for topic in self.rates.due():
            if not self._listeners[topic]:
                continue
            if topic == ROBOT_STATUS:
                content = self._status()
            else:
                state = self._robot.state if state is None else state
                content = None if state is None else self._content(topic, state)
            if content is not None:
                self._publish(topic, content)

    def skip(self, ticks: int) -> None:
        """The robot has made `ticks` ticks while the node was not `watching`."""
        self.rates.skip(ticks)

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

    def _status(self) -> Message | None:
        """The message for /robot_status; None if nothing is known."""
        status = self._robot.status
        if status is None:
            return None
        *flags, code = status
        values = {name: {"val": flag} for name, flag in zip(status._fields[:-1], flags, strict=True)}
        return {"header": self._header(ROBOT_STATUS), **values, "error_code": code}

    def _content(self, topic: str, state: State) -> Message | None:
        """The message for a topic; None if the robot does not report the contents."""
        if topic == "/joint_states":
            return {
                "header": self._header(topic),
                "name": list(self._robot.joint_names),
                "position": list(state.joints),
                "velocity": [] if state.velocities is None else list(state.velocities),
                "effort": [],
            }
        if topic == "/tool_frame":
            x_mm, y_mm, z_mm, alpha, beta, gamma = state.tool_frame
            places = {"x": 1e-3 * x_mm, "y": 1e-3 * y_mm, "z": 1e-3 * z_mm}
            return {**places, "alpha": alpha, "beta": beta, "gamma": gamma}
        if topic == "/current_speed_scale":
            return None if state.override is None else {"data": state.override}
        pins = Pins.of(state)
        if isinstance(pins, Failure):
            return None
        inputs, outputs = (
            [{"pin_number": number, "pin_value": value} for number, value in row] for row in pins.numbered()
        )
        return {"inputs": inputs, "outputs": outputs}

    def _header(self, topic: str) -> Message:
        sequence = self._sequence[topic]
        self._sequence[topic] = (sequence + 1) % 2**32
        return {"seq": sequence, "stamp": self.time(), "frame_id": ""}
