"""The services of Appendix A2, and those for inputs and outputs that drag&bot's AnyRobot interface adds.

A service takes its request and two calls, one of which it makes once, then or later: `answer` with the
response, `fail` with the reason why there is none.
"""

from collections.abc import Callable
from math import isfinite
from typing import Any

from iiwa_sim.controller.controller import LEAST_OVERRIDE
from iiwa_sim.dialect.rmi.command_queue import CommandQueue
from iiwa_sim.dialect.rmi.pins import INPUT_GROUP, OUTPUT_GROUP, Pins
from iiwa_sim.dialect.rmi.robot import Failure, Robot

Response = dict[str, Any]
Answer = Callable[[Response], None]
Fail = Callable[[str], None]

LOWEST_SCALE = 0.01
"""What a speed below 0 becomes."""
NO_ERROR = 0


class Services:
    """Those of one robot. Requests are messages of `definitions.type_of`."""

    def __init__(self, robot: Robot, queue: CommandQueue) -> None:
        self._robot = robot
        self._queue = queue
        self.all: dict[str, tuple[str, Callable[[Any, Answer, Fail], None]]] = {
            "/scale_speed": ("robot_movement_interface/SetFloat", self._scale_speed),
            "/get_io": ("robot_movement_interface/GetIO", self._get_io),
            "/set_io": ("robot_movement_interface/SetIO", self._set_io),
            "/stop_robot_right_now": ("std_srvs/Trigger", self._stop),
            "/robot/get_digital_ios": ("iiwa_sim_msgs/GetDigitalIOs", self._get_digital_ios),
            "/robot/set_digital_ios": ("iiwa_sim_msgs/SetDigitalIOs", self._set_digital_ios),
        }
        """Type and call of each, by name."""

    def _scale_speed(self, request: Any, answer: Answer, fail: Fail) -> None:
        """Below 0 is 0.01, above 1 is 1; at 0 the robot stops, too, and forgets its commands."""
        value = request.value
        if not isfinite(value):
            fail("value: expected a finite number")
            return
        scale = LOWEST_SCALE if value < 0.0 else min(value, 1.0)
        if 0.0 < scale < LEAST_OVERRIDE:
            scale = LEAST_OVERRIDE

        def set_scale(stopped: Failure | None) -> None:
            if stopped is None:
                self._robot.set_override(scale, lambda failure: _tell(failure, answer, fail))
            else:
                fail(stopped.reason)

        if scale == 0.0:
            self._queue.cancel("cancelled by scale_speed 0", set_scale)
        else:
            set_scale(None)

    def _stop(self, _: Any, answer: Answer, __: Fail) -> None:
        self._queue.cancel("cancelled by stop_robot_right_now", lambda failure: answer(_success(failure)))

    def _get_io(self, request: Any, answer: Answer, _: Fail) -> None:
        pins = Pins.of(self._robot.state)
        state = pins if isinstance(pins, Failure) else pins.get(request.number)
        if isinstance(state, Failure):
            answer({"value": False, "error": state.code})
        else:
            answer({"value": state, "error": NO_ERROR})

    def _set_io(self, request: Any, answer: Answer, _: Fail) -> None:
        pins = Pins.of(self._robot.state)
        number = pins if isinstance(pins, Failure) else pins.output(request.number)
        if isinstance(number, Failure):
            answer({"error": number.code})
            return

        def done(failure: Failure | None) -> None:
            answer({"error": NO_ERROR if failure is None else failure.code})

        self._robot.set_output(number, request.value, done)

    def _get_digital_ios(self, request: Any, answer: Answer, _: Fail) -> None:
        pins = Pins.of(self._robot.state)
        if isinstance(pins, Failure):
            answer({**_success(pins), "ios": []})
            return
        named = [(pin.group_id, pin.pin_number) for pin in request.ios] or [
            (group, number)
            for group, row in ((INPUT_GROUP, pins.inputs), (OUTPUT_GROUP, pins.outputs))
            for number in range(1, len(row) + 1)
        ]
        ios = []
        for group, number in named:
            state = pins.in_group(group, number)
            if isinstance(state, Failure):
                answer({**_success(state), "ios": []})
                return
            ios.append({"group_id": group, "pin_number": number, "value": state})
        answer({**_success(None), "ios": ios})

    def _set_digital_ios(self, request: Any, answer: Answer, _: Fail) -> None:
        pins = Pins.of(self._robot.state)
        if isinstance(pins, Failure):
            answer(_success(pins))
            return
        for pin in request.ios:
            state = pins.in_group(pin.group_id, pin.pin_number)
            if isinstance(state, Failure):
                answer(_success(state))
                return
            if pin.group_id == INPUT_GROUP:
                answer({"success": False, "message": f"{INPUT_GROUP} {pin.pin_number} is an input"})
                return
        waiting = [(pin.pin_number, pin.value) for pin in reversed(request.ios)]

        def next_one(failure: Failure | None) -> None:
            if failure is not None or not waiting:
                answer(_success(failure))
            else:
                self._robot.set_output(*waiting.pop(), next_one)

        next_one(None)


def _tell(failure: Failure | None, answer: Answer, fail: Fail) -> None:
    if failure is None:
        answer({})
    else:
        fail(failure.reason)


def _success(failure: Failure | None) -> Response:
    return {"success": failure is None, "message": "" if failure is None else failure.reason}
