"""The topics and services of drag&bot's drivers (Appendix A of its requirements), for one robot.

Every command gets one result, in the order of the commands. When one fails, later commands are not carried
out, since they begin where it should have ended; their results say so.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from iiwa_sim.controller.controller import LEAST_OVERRIDE, Controller
from iiwa_sim.controller.errors import EXECUTION, STOP_TRIGGERED, SUCCESS, Refused
from iiwa_sim.controller.requests import Kind
from iiwa_sim.log import SessionLog
from iiwa_sim.ros.commands import read_command
from iiwa_sim.ros.graph import Endpoint, Graph, Topic
from iiwa_sim.ros.messages import Message

COMMAND_RESULT = "/command_result"
LONGEST_QUEUE = 1000
"""Commands that have no result yet; a list that adds more is refused."""
PLAIN = {Kind.LIN.value, Kind.PTP.value}
"""Types of moves that are sent ahead, so that the robot can blend them."""
NO_SUCH_GROUP = 3
"""Error of services of digital inputs and outputs, besides those of `iiwa_sim.controller.io`."""
_RMI = "robot_movement_interface"


@dataclass
class _Command:
    """A command whose result is not published yet."""

    message: Any
    result: tuple[int, str] | None = None
    """Code and information; only the first end counts, as the robot may report a replaced move later."""


class AppendixA:
    """Commands of a robot and their results, its states, and services for speed, inputs and outputs."""

    def __init__(
        self, graph: Graph, controller: Controller, log: SessionLog, *, apply_reference: bool
    ) -> None:
        """`apply_reference` says whether a pose_reference_frame is applied."""
        self._graph = graph
        self._controller = controller
        self._log = log
        self._apply_reference = apply_reference
        self._begun: deque[_Command] = deque()  # sent or refused; not published
        self._waiting: deque[_Command] = deque()  # not sent yet
        self._servo = ""  # the type of the command whose target the servo follows
        self._failed = False
        for name, kind, rate_hz, content in (
            (COMMAND_RESULT, f"{_RMI}/msg/Result", 0, None),
            ("/robot_status", "industrial_msgs/msg/RobotStatus", 50, self._status),
            ("/tool_frame", f"{_RMI}/msg/EulerFrame", 100, self._tool_frame),
            ("/joint_states", "sensor_msgs/msg/JointState", 100, self.joint_states),
            ("/current_speed_scale", "std_msgs/msg/Float32", 10, lambda: {"data": controller.override}),
            ("/io_states", f"{_RMI}/msg/IOStates", 10, self._io_states),
        ):
            graph.published[name] = Topic(kind, rate_hz, content, in_ros1=True)
        graph.subscribed["/command_list"] = Endpoint(f"{_RMI}/msg/CommandList", self._take, in_ros1=True)
        for name, kind, answer in (
            ("/scale_speed", f"{_RMI}/srv/SetFloat", self._scale_speed),
            ("/get_io", f"{_RMI}/srv/GetIO", self._get_io),
            ("/set_io", f"{_RMI}/srv/SetIO", self._set_io),
            ("/stop_robot_right_now", "std_srvs/srv/Trigger", self._stop_right_now),
            ("/robot/get_digital_ios", f"{_RMI}/srv/GetDigitalIOs", self._get_digital_ios),
            ("/robot/set_digital_ios", f"{_RMI}/srv/SetDigitalIOs", self._set_digital_ios),
        ):
            graph.services[name] = Endpoint(kind, answer, in_ros1=True)

    # Commands

    @property
    def has_commands(self) -> bool:
        """True if a coming tick will send a command or publish a result."""
        if self._begun:
            return self._begun[0].result is not None or self._failed
        return bool(self._waiting) and self._controller.override > 0.0

    def _take(self, message: Any) -> None:
        """Take a CommandList: its commands follow those before, or take their place.

        An empty list that replaces stops the robot.
        """
        commands: Sequence[Any] = message.commands
        before = 0 if message.replace_previous_commands else len(self._begun) + len(self._waiting)
        if before + len(commands) > LONGEST_QUEUE:
            raise Refused(EXECUTION, f"expected at most {LONGEST_QUEUE} commands without a result")
        if message.replace_previous_commands:
            follows = self._servo and commands and commands[0].command_type == self._servo
            self._end_all("replaced by a newer list of commands")
            if not follows:  # a servo takes a new target without stopping
                self._stop()
        self._waiting.extend(map(_Command, commands))

    def step(self) -> None:
        """Notice a tick: send commands whose time has come, and publish results."""
        if self._failed:
            self._failed = False
            self._stop_after_failure()
        if self._waiting and self._controller.override > 0.0:
            self._send_next()
        self._publish_ended()

    def _send_next(self) -> None:
        """Send a command, unless it has to wait for those before.

        A servo move would replace the running move, and a force move compares with the forces at its command.
        """
        command = self._waiting[0]
        last = next((other for other in reversed(self._begun) if other.result is None), None)
        if last is not None and not {last.message.command_type, command.message.command_type} <= PLAIN:
            return
        self._begun.append(self._waiting.popleft())
        try:
            move = read_command(command.message, self._controller, apply_reference=self._apply_reference)
            self._servo = move.kind.value if move.kind.is_servo else ""
            self._controller.move(move, lambda ending: self._end(command, ending.code, ending.reason))
        except Refused as refused:
            self._controller.errors.record(refused.code, refused.reason)
            self._end(command, refused.code, refused.reason)

    def _end(self, command: _Command, code: int, information: str) -> None:
        if command.result is not None:
            return
        command.result = code, information
        if code != SUCCESS:
            self._failed = True
            number = command.message.command_id
            if code != STOP_TRIGGERED:
                self._log.refused("ros", f"command {number}", code, information)
            for other in self._waiting:
                other.result = code, f"not carried out, after command {number}: {information}"
            self._begun.extend(self._waiting)
            self._waiting.clear()

    def _end_all(self, reason: str) -> None:
        self._begun.extend(self._waiting)
        self._waiting.clear()
        for command in self._begun:
            command.result = command.result or (STOP_TRIGGERED, reason)
        self._publish_ended()

    def _stop(self) -> None:
        self._servo = ""
        self._controller.stop()

    def _stop_after_failure(self) -> None:
        """Stop moves that were sent behind a failed one, or a servo whose next target was refused."""
        codes = [None if each.result is None else each.result[0] for each in self._begun]
        failed = next((place for place, code in enumerate(codes) if code), len(codes))
        if None in codes[failed:] or (self._controller.mode.name == self._servo and None not in codes):
            self._stop()

    def _publish_ended(self) -> None:
        while self._begun and (result := self._begun[0].result) is not None:
            number, (code, information) = self._begun.popleft().message.command_id, result
            content = {"command_id": number, "result_code": code, "additional_information": information}
            self._graph.published[COMMAND_RESULT].publish({"header": self._graph.header(), **content})

    # States

    def joint_states(self) -> Message:
        """Return the message of /joint_states."""
        return {
            "header": self._graph.header(),
            "name": list(self._controller.description.joints),
            "position": list(self._controller.joints),
            "velocity": list(self._controller.joint_velocity()),
            "effort": [],
        }

    def _status(self) -> Message:
        values = self._controller.status()._asdict()
        code = values.pop("error_code")
        flags = {name: {"val": flag} for name, flag in values.items()}
        return {"header": self._graph.header(), **flags, "error_code": code}

    def _tool_frame(self) -> Message:
        frame = self._controller.tool_frame()._asdict()
        return {
            name.removesuffix("_mm"): 1e-3 * v if name.endswith("_mm") else v for name, v in frame.items()
        }

    def _io_states(self) -> Message:
        io = self._controller.io

        def pins(row: Sequence[bool], first: int) -> list[Message]:
            return [{"pin_number": number, "pin_value": value} for number, value in enumerate(row, first)]

        return {"inputs": pins(io.inputs, len(io.outputs) + 1), "outputs": pins(io.outputs, 1)}

    # Services. The common numbering of pins has outputs first, with the controller's numbers; inputs follow.

    def _scale_speed(self, request: Any) -> Message:
        """Set the speed: below 0 means 0.01, above 1 means 1. At 0 the robot stops and drops its commands."""
        scale = 0.01 if request.value < 0.0 else min(request.value, 1.0)
        if scale == 0.0:
            self._end_all("cancelled by scale_speed 0")
            self._stop()
        self._controller.set_override(max(scale, LEAST_OVERRIDE) if scale else 0.0)
        return {}

    def _stop_right_now(self, _: Any) -> Message:
        self._end_all("cancelled by stop_robot_right_now")
        self._stop()
        return {"success": True, "message": ""}

    def _get_io(self, request: Any) -> Message:
        return self._io(request.number, self._controller.io.output, self._controller.io.input)

    def _set_io(self, request: Any) -> Message:
        io = self._controller.io
        answer = self._io(request.number, lambda n: io.set_output(n, request.value), io.refuse_input)
        return {"error": answer["error"]}

    def _io(self, number: int, output: Callable[[int], Any], of_input: Callable[[int], Any]) -> Message:
        outputs = len(self._controller.io.outputs)
        try:
            value = output(number) if number <= outputs else of_input(number - outputs)
        except Refused as refused:
            return {"value": False, "error": refused.code}
        return {"value": value, "error": 0}

    def _pins(
        self, pins: Iterable[tuple[str, int]], act: Mapping[str, Callable[[int], Any]]
    ) -> tuple[list[Message], list[Message]]:
        """Return the states of pins, numbered in their groups, and the errors of those that are wrong."""
        states, errors = list[Message](), list[Message]()
        for group, number in pins:
            pin = {"group_id": group, "pin_number": number}
            try:
                if group not in act:
                    raise Refused(NO_SUCH_GROUP, "expected a group_id DI or DO")
                states.append({"id": pin, "value": act[group](number), "stamp": self._graph.stamp})
            except Refused as refused:
                errors.append({"id": pin, "error": refused.code, "message": refused.reason})
        return states, errors

    def _get_digital_ios(self, request: Any) -> Message:
        io = self._controller.io
        every = [("DI", number) for number in range(1, len(io.inputs) + 1)]
        every += [("DO", number) for number in range(1, len(io.outputs) + 1)]
        pins = [(each.group_id, each.pin_number) for each in request.ios] or every
        states, errors = self._pins(pins, {"DI": io.input, "DO": io.output})
        return {"ios": states, "success": not errors, "errors": errors}

    def _set_digital_ios(self, request: Any) -> Message:
        """Switch all outputs or none."""
        io = self._controller.io
        pins = [(each.id.group_id, each.id.pin_number) for each in request.ios]
        _, errors = self._pins(pins, {"DI": io.refuse_input, "DO": io.output})
        for each in [] if errors else request.ios:
            io.set_output(each.id.pin_number, each.value)
        return {"success": not errors, "errors": errors}
