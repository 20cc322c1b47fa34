"""What acts from outside on a robot that yields, as the motions see it."""

from collections.abc import Callable
from typing import Protocol

from iiwa_sim.frames import Transform, Vector

Feel = Callable[[Vector, Vector, float], tuple[Vector, Vector]]
"""What surfaces do to a TCP at a position (m) with a velocity (m/s) in the base: force (N) and torque (Nm)
about the TCP, in base axes, acting on the robot. The time (s) for which it is there moves the memory of
friction on; with 0 that stays as it is. `iiwa_sim.contact.world_kernel.World.feel` is one."""

NOTHING: tuple[Vector, Vector] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

LONGEST_SUBSTEP_S = 0.001
"""In contact a tick is cut into parts no longer than this: with a surface of 1e5 N/m an apparent mass of 5 kg
swings at 141 rad/s, which makes 0.14 rad in such a part."""

Felt = tuple[Transform, tuple[Vector, Vector] | None]
"""What a motion knows of the TCP at the end of a tick, so that nobody has to find it again: its pose in the
base, and what surfaces do to it there, as `Feel` gives it; None where that has yet to be felt."""


class Pushes(Protocol):
    """What pushes the robot. `iiwa_sim.contact.load.ExternalLoad` is one."""

    @property
    def wrench(self) -> tuple[float, float, float, float, float, float]:
        """Force (N) and torque (Nm) at the TCP, along its axes."""

    @property
    def joint_push(self) -> tuple[float, ...]:
        """Torque (Nm) on each joint."""
