"""Conventions in which users of robot_movement_interface differ: options of a robot on ROS."""

from enum import Enum
from typing import NamedTuple


class ResultType(Enum):
    """The versions of the message Result; the values are how many constants each has.

    Constants count in the MD5 sum that both ends of a ROS 1 topic compare.
    """

    YEAR_2016 = 0
    YEAR_2021 = 10
    YEAR_2023 = 13
    YEAR_2024 = 14


RESULT_TYPES = {
    2016: ResultType.YEAR_2016,
    2021: ResultType.YEAR_2021,
    2023: ResultType.YEAR_2023,
    2024: ResultType.YEAR_2024,
}
"""By the year in which robot_movement_interface had them."""


class Reference(Enum):
    """The meaning of a pose_reference_frame with values, where pose_reference does not name the base."""

    APPLY = "apply"
    """The pose is given in that frame and is transformed into the base."""
    IGNORE = "ignore"
    """The pose is in the base already: drag&bot's frame publisher transforms it and leaves the fields."""


class Stamps(Enum):
    """The time that goes into headers, and with which the stamps of trajectories are compared."""

    REAL = "real"
    SIMULATED = "simulated"
    """The time of /clock, for nodes with use_sim_time."""


class Conventions(NamedTuple):
    """The conventions of one robot."""

    result: ResultType = ResultType.YEAR_2024
    reference: Reference = Reference.APPLY
    stamps: Stamps = Stamps.REAL


TODAYS = Conventions()
