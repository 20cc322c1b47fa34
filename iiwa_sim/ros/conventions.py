"""Conventions of clients on ROS, and the error for a robot that cannot be there."""

from iiwa_sim.wording import Unusable

RESULT_CONSTANTS = {2016: 0, 2021: 10, 2023: 13, 2024: 14}
"""Number of constants of robot_movement_interface's message Result, by the year of the package.

Constants count in the MD5 sum that both ends of a ROS 1 topic compare.
"""
NEWEST_RESULT = max(RESULT_CONSTANTS)
APPLY, IGNORE = "apply", "ignore"
"""What to do with a pose_reference_frame with values, where pose_reference does not name the base.

drag&bot's frame publisher transforms a pose to the base and leaves the fields: such a frame is ignored.
"""
REAL, SIMULATED = "real", "simulated"
"""The time that goes into headers, and with which the stamps of trajectories are compared.

Simulated time is that of /clock, for nodes with use_sim_time.
"""


class RosFault(Unusable):
    """A library or service that the ROS side needs is missing, or there can be no node. The message is one
    line."""
