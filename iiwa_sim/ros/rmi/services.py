"""The services of Appendix A2, and those for inputs and outputs of drag&bot's AnyRobot interface.

A service gets its request and two functions, one of which it calls once, at once or later: `answer` with the
response, or `fail` with the reason why there is none.
"""

from collections.abc import Callable
from math import isfinite
from typing import Any

from iiwa_sim.controller.controller import LEAST_OVERRIDE
from iiwa_sim.controller.io import NUMBER_OUT_OF_RANGE
from iiwa_sim.ros.rmi.command_queue import CommandQueue
from iiwa_sim.ros.rmi.pins import INPUT_GROUP, OUTPUT_GROUP, SETTING_FAILED, Pins
from iiwa_sim.ros.rmi.robot import Failure, Robot

Response = dict[str, Any]
Answer = Callable[[Response], None]
Fail = Callable[[str], None]

LOWEST_SCALE = 0.01
"""Replaces a speed below 0."""
NO_ERROR = 0


class Services:
    """The services of one robot. Requests are messages of `definitions.type_of`."""

    def __init__(self, robot: Robot, queue: CommandQueue, now: Callable[[], dict[str, int]]) -> None:
        """`now` returns ROS time, for the stamps of readings."""
        self._robot = robot
        self._queue = queue
        self._now = now
        self.all: dict[str, tuple[str, Callable[[Any, Answer, Fail], None]]] = {
            "/scale_speed": ("robot_movement_interface/SetFloat", self._scale_speed),
            "/get_io": ("robot_movement_interface/GetIO", self._get_io),
            "/set_io": ("robot_movement_interface/SetIO", self._set_io),
            "/stop_robot_right_now": ("std_srvs/Trigger", self._stop),
            "/robot/get_digital_ios": ("robot_movement_interface/GetDigitalIOs", self._get_digital_ios),
            "/robot/set_digital_ios": ("robot_movement_interface/SetDigitalIOs", self._set_digital_ios),
        }
        """Type and handler of each service."""

    def _scale_speed(self, request: Any, answer: Answer, fail: Fail) -> None:
        """Set the speed: below 0 means 0.01, above 1 means 1. At 0 the robot also stops and drops its
        commands."""
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
            unknown = Failure(NUMBER_OUT_OF_RANGE, pins.reason)
            named = [(pin.group_id, pin.pin_number) for pin in request.ios] or [("", 0)]
            answer({"ios": [], "success": False, "errors": [_io_error(*pin, unknown) for pin in named]})
            return
        named = [(pin.group_id, pin.pin_number) for pin in request.ios] or [
            (group, number)
            for group, row in ((INPUT_GROUP, pins.inputs), (OUTPUT_GROUP, pins.outputs))
            for number in range(1, len(row) + 1)
        ]
        ios, errors, stamp = [], [], self._now()
        for group, number in named:
            state = pins.in_group(group, number)
            if isinstance(state, Failure):
                errors.append(_io_error(group, number, state))
            else:
                ios.append({"id": _io_id(group, number), "value": state, "stamp": stamp})
        answer({"ios": ios, "success": not errors, "errors": errors})

    def _set_digital_ios(self, request: Any, answer: Answer, _: Fail) -> None:
        """Switch all outputs or none. If the robot fails to switch one, those before it stay switched."""
        named = [(pin.id.group_id, pin.id.pin_number) for pin in request.ios]
        pins = Pins.of(self._robot.state)
        if isinstance(pins, Failure):
            unknown = Failure(SETTING_FAILED, pins.reason)
            answer({"success": False, "errors": [_io_error(*pin, unknown) for pin in named]})
            return
        refused = [(pin, pins.to_switch(*pin)) for pin in named]
        errors = [_io_error(*pin, failure) for pin, failure in refused if failure is not None]
        if errors:
            answer({"success": False, "errors": errors})
            return
        waiting = [(number, pin.value) for (_, number), pin in zip(named, request.ios, strict=True)][::-1]
        switching = 0

        def next_one(failure: Failure | None) -> None:
            nonlocal switching
            if failure is not None:
                failed = Failure(SETTING_FAILED, failure.reason)
                answer({"success": False, "errors": [_io_error(OUTPUT_GROUP, switching, failed)]})
            elif not waiting:
                answer({"success": True, "errors": []})
            else:
                switching, value = waiting.pop()
                self._robot.set_output(switching, value, next_one)

        next_one(None)


def _io_id(group: str, number: int) -> Response:
    return {"group_id": group, "pin_number": number}


def _io_error(group: str, number: int, failure: Failure) -> Response:
    return {"id": _io_id(group, number), "error": failure.code, "message": failure.reason}


def _tell(failure: Failure | None, answer: Answer, fail: Fail) -> None:
    if failure is None:
        answer({})
    else:
        fail(failure.reason)


def _success(failure: Failure | None) -> Response:
    return {"success": failure is None, "message": "" if failure is None else failure.reason}
