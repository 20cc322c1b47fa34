"""The state of the robot in the terms of ROS-Industrial: fields and values of industrial_msgs/RobotStatus."""

from typing import NamedTuple

from iiwa_sim.controller.faults import NO_CODE, Faults

AUTOMATIC = 2
"""The mode in which a controller takes moves from a driver; it is in no other."""


class RobotStatus(NamedTuple):
    """What is not a number of its own is 1 for true and 0 for false."""

    mode: int
    e_stopped: int
    """The emergency stop is pressed."""
    drives_powered: int
    motion_possible: int
    """A move would be accepted."""
    in_motion: int
    """The robot moves: unlike `get status`, not in a pause."""
    in_error: int
    error_code: int
    """The cause of the state of error, 0 outside of it."""


def status_of(faults: Faults, *, in_motion: bool) -> RobotStatus:
    """Status of a robot with these faults."""
    code = None if faults.standing is None else faults.standing.code
    return RobotStatus(
        mode=AUTOMATIC,
        e_stopped=int(faults.e_stopped),
        drives_powered=int(faults.drives_powered),
        motion_possible=int(code is None),
        in_motion=int(in_motion),
        in_error=int(code is not None),
        error_code=NO_CODE if code is None else code,
    )
