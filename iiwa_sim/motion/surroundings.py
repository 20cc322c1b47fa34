"""What acts from outside on a robot that yields, as the motions see it."""

from typing import Protocol

from iiwa_sim.wrench import Wrench

LONGEST_SUBSTEP_S = 0.001
"""In contact a tick is cut into parts no longer than this: with a surface of 1e5 N/m an apparent mass of 5 kg
swings at 141 rad/s, which makes 0.14 rad in such a part."""


STIFF, COMPLIANT_TCP, COMPLIANT_JOINTS = 0, 1, 2
"""How a robot gives way: not at all, as a mass at the TCP, or in each joint."""


class Pushes(Protocol):
    """What pushes the robot: `pushes` of `iiwa_sim.contact.acting_kernel.Acting` is one."""

    @property
    def tcp_push(self) -> Wrench:
        """Push at the TCP, along its axes."""

    @property
    def joint_push(self) -> tuple[float, ...]:
        """Torque (Nm) on each joint."""
