"""The state of the robot in the terms of ROS-Industrial: fields and values of industrial_msgs/RobotStatus."""

from typing import NamedTuple

from iiwa_sim.controller.error_state import NO_CODE, RobotErrors

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
    """The cause of the error state, 0 outside of it."""


def status_of(errors: RobotErrors, *, in_motion: bool) -> RobotStatus:
    """Status of a robot with these errors."""
    code = None if errors.standing is None else errors.standing.code
    return RobotStatus(
        mode=AUTOMATIC,
        e_stopped=int(errors.e_stopped),
        drives_powered=int(errors.drives_powered),
        motion_possible=int(code is None),
        in_motion=int(in_motion),
        in_error=int(code is not None),
        error_code=NO_CODE if code is None else code,
    )
