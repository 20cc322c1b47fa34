"""What acts from outside on a robot that yields, as the motions see it."""

from collections.abc import Callable
from typing import Protocol

from iiwa_sim.frames import Vector
from iiwa_sim.wrench import Touch, Wrench

Feel = Callable[[Vector, Vector, float], Touch]
"""What surfaces do to a TCP at a position (m) with a velocity (m/s) in the base. The time (s) for which it is
there moves the memory of friction on; with 0 that stays as it is. `iiwa_sim.contact.world_kernel.World.feel`
is one."""

LONGEST_SUBSTEP_S = 0.001
"""In contact a tick is cut into parts no longer than this: with a surface of 1e5 N/m an apparent mass of 5 kg
swings at 141 rad/s, which makes 0.14 rad in such a part."""


class Pushes(Protocol):
    """What pushes the robot: `pushes` of `iiwa_sim.contact.acting_kernel.Acting` is one."""

    @property
    def tcp_push(self) -> Wrench:
        """At the TCP, along its axes."""

    @property
    def joint_push(self) -> tuple[float, ...]:
        """Torque (Nm) on each joint."""
