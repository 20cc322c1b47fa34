"""The services of Appendix A2, and those for inputs and outputs of drag&bot's AnyRobot interface."""

from collections.abc import Callable
from math import isfinite
from typing import Any

from iiwa_sim.controller.controller import LEAST_OVERRIDE, Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.rmi.command_queue import CommandQueue
from iiwa_sim.ros.rmi.message_text import BadMessage
from iiwa_sim.ros.rmi.pins import INPUT_GROUP, OUTPUT_GROUP, Pins

Response = dict[str, Any]

LOWEST_SCALE = 0.01
"""Replaces a speed below 0."""
NO_ERROR = 0


class Services:
    """The services of one robot. Requests are messages of `definitions.type_of`."""

    def __init__(
        self, controller: Controller, queue: CommandQueue, now: Callable[[], dict[str, int]]
    ) -> None:
        """`now` returns ROS time, for the stamps of readings."""
        self._controller = controller
        self._queue = queue
        self._now = now
        self.all: dict[str, tuple[str, Callable[[Any], Response]]] = {
            "/scale_speed": ("robot_movement_interface/SetFloat", self._scale_speed),
            "/get_io": ("robot_movement_interface/GetIO", self._get_io),
            "/set_io": ("robot_movement_interface/SetIO", self._set_io),
            "/stop_robot_right_now": ("std_srvs/Trigger", self._stop),
            "/robot/get_digital_ios": ("robot_movement_interface/GetDigitalIOs", self._get_digital_ios),
            "/robot/set_digital_ios": ("robot_movement_interface/SetDigitalIOs", self._set_digital_ios),
        }
        """Type and handler of each service."""

    def _scale_speed(self, request: Any) -> Response:
        """Set the speed: below 0 means 0.01, above 1 means 1. At 0 the robot also stops and drops its
        commands. Raises BadMessage."""
        value = request.value
        if not isfinite(value):
            raise BadMessage("value: expected a finite number")
        scale = LOWEST_SCALE if value < 0.0 else min(value, 1.0)
        if scale == 0.0:
            self._queue.cancel("cancelled by scale_speed 0")
        self._controller.set_override(max(scale, LEAST_OVERRIDE) if scale else 0.0)
        return {}

    def _stop(self, _: Any) -> Response:
        self._queue.cancel("cancelled by stop_robot_right_now")
        return {"success": True, "message": ""}

    def _get_io(self, request: Any) -> Response:
        try:
            return {"value": Pins.of(self._controller.io).get(request.number), "error": NO_ERROR}
        except Refused as refused:
            return {"value": False, "error": refused.code}

    def _set_io(self, request: Any) -> Response:
        try:
            Pins.of(self._controller.io).check_output(request.number)
        except Refused as refused:
            return {"error": refused.code}
        self._controller.io.set_output(request.number, request.value)
        return {"error": NO_ERROR}

    def _get_digital_ios(self, request: Any) -> Response:
        pins = Pins.of(self._controller.io)
        named = [(pin.group_id, pin.pin_number) for pin in request.ios] or [
            (group, number)
            for group, row in ((INPUT_GROUP, pins.inputs), (OUTPUT_GROUP, pins.outputs))
            for number in range(1, len(row) + 1)
        ]
        ios, errors, stamp = [], [], self._now()
        for group, number in named:
            try:
                value = pins.in_group(group, number)
            except Refused as refused:
                errors.append(_io_error(group, number, refused))
            else:
                ios.append({"id": _io_id(group, number), "value": value, "stamp": stamp})
        return {"ios": ios, "success": not errors, "errors": errors}

    def _set_digital_ios(self, request: Any) -> Response:
        """Switch all outputs or none."""
        pins, errors = Pins.of(self._controller.io), []
        for each in request.ios:
            try:
                pins.check_switched(each.id.group_id, each.id.pin_number)
            except Refused as refused:
                errors.append(_io_error(each.id.group_id, each.id.pin_number, refused))
        if not errors:
            for each in request.ios:
                self._controller.io.set_output(each.id.pin_number, each.value)
        return {"success": not errors, "errors": errors}


def _io_id(group: str, number: int) -> Response:
    return {"group_id": group, "pin_number": number}


def _io_error(group: str, number: int, refused: Refused) -> Response:
    return {"id": _io_id(group, number), "error": refused.code, "message": refused.reason}
