"""Options of a robot on ROS, among them conventions in which users of robot_movement_interface differ."""

from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
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
"""Types of results by the year in which robot_movement_interface had them."""


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


COMMON_RATE_HZ = 100
"""The usual rate of joint states, transforms, and what else is told of the motion."""


class Conventions(NamedTuple):
    """The conventions of one robot."""

    result: ResultType = ResultType.YEAR_2024
    reference: Reference = Reference.APPLY
    stamps: Stamps = Stamps.REAL
    rate_hz: int = COMMON_RATE_HZ
    """The rate of all topics that otherwise have 100 Hz of simulated time; no more than ticks."""

    def rates(self, usual_hz: Mapping[str, int]) -> dict[str, int]:
        """The rates of topics, by those they usually have."""
        return {
            topic: self.rate_hz if usual == COMMON_RATE_HZ else usual for topic, usual in usual_hz.items()
        }


TODAYS = Conventions()


class RosOptions(NamedTuple):
    """How a robot is on ROS; `Simulator` says what each option does."""

    host: str
    rosbridge_port: int | None = None
    rosbridge_secret: str | None = None
    rosbridge_origins: Sequence[str] = ()
    rosbridge_hosts: Sequence[str] = ()
    ros: bool = False
    ros2: bool = False
    ros2_python: Path | None = None
    ros_namespace: str = ""
    ros_conventions: Conventions = TODAYS
