"""Messages of rclpy as plain ones, by a stand-in for a message: rclpy itself is in `test_process.py`."""

from __future__ import annotations

from array import array
from typing import Any

from iiwa_sim.ros.ros2.rclpy_node.messages import plain


class Pose:
    """As rclpy has one: floats of 32 bits are Python's floats, lists of them arrays."""

    x, y, values = 0.10000000149011612, 0.10000000149011612, array("f", [0.4, 2.094395])

    def get_fields_and_field_types(self) -> dict[str, Any]:
        return {"x": "float", "y": "double", "values": "sequence<float>"}


def test_values_of_32_bits_are_the_decimals_that_they_stand_for() -> None:
    assert plain(Pose()) == {"x": 0.1, "y": 0.10000000149011612, "values": [0.4, 2.094395]}
    assert plain(array("d", [0.1])) == [0.1]
