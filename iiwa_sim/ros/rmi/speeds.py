"""Joint speeds in the unit that controllers take: relative to the limits."""

from collections.abc import Sequence

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.ros.rmi.robot import Move, SpeedUnit


def joint_speeds_rel(move: Move, names: Sequence[str], limits_rad_s: Sequence[float]) -> tuple[float, ...]:
    """The speeds (0..1] of all joints of a move to joint positions; one speed is that of each of them.

    Raises `Refused` where one is above its limit (rad/s).
    """
    speeds = move.speeds * len(names) if len(move.speeds) == 1 else move.speeds
    if move.speed_unit is SpeedUnit.RELATIVE:
        return speeds
    for name, speed, limit in zip(names, speeds, limits_rad_s, strict=True):
        if speed > limit:
            raise Refused(EXECUTION, f"velocity {speed:g} rad/s: {name} goes up to {limit:.7g} rad/s")
    return tuple(speed / limit for speed, limit in zip(speeds, limits_rad_s, strict=True))
