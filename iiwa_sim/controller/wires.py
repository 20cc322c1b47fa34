"""Wires between the inputs and outputs of a controller and the sensors and actuators of a scene."""

from __future__ import annotations

import math
from typing import Any, NamedTuple


class InputWire(NamedTuple):
    """An input that is on while a sensor reads more than `above` and less than `below`."""

    number: int
    readings: slice  # in `MjData.sensordata`
    is_distance: bool
    above: float
    below: float

    def is_on(self, data: Any) -> bool:
        """Return whether the input is on: by the number that the sensor reads, or by the norm of several.

        A rangefinder that sees nothing reads an infinite distance.
        """
        values = data.sensordata[self.readings].tolist()
        value = values[0] if len(values) == 1 else math.hypot(*values)
        if self.is_distance and value < 0.0:
            value = math.inf
        return self.above < value < self.below


class OutputWire(NamedTuple):
    """An output that drives an actuator, a conveyor or an equality of the scene."""

    number: int
    driven: int  # the actuator, the geom or the equality in the model
    switches: bool  # True for an equality, which is active unless the number is 0
    direction: tuple[float, ...]  # of a conveyor: `surfacevel` for a speed of 1
    on: float
    off: float

    def drive(self, model: Any, data: Any, on: bool) -> bool:
        """Drive it for the next ticks; returns True if that is news."""
        value, driven = self.on if on else self.off, self.driven
        if self.direction:
            speeds = [value * each for each in self.direction]
            changes = model.geom_surfacevel[driven].tolist() != speeds
            model.geom_surfacevel[driven] = speeds
        else:
            array, wanted = (data.eq_active, value != 0.0) if self.switches else (data.ctrl, value)
            changes = array[driven] != wanted
            array[driven] = wanted
        return bool(changes)
