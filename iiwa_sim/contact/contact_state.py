"""What a robot at rest feels of all that it touches, as a named state keeps it."""

from typing import NamedTuple

from iiwa_sim.wrench import Wrench


class ContactState(NamedTuple):
    """The forces on a robot that stands still, and the memory of its contacts."""

    world: object
    links: object
    wrenches: tuple[Wrench, Wrench]
    """Wrenches of surfaces at the TCP, and on tool and jaws."""
    torques: tuple[tuple[float, ...] | None, tuple[float, ...] | None]
    """Joint torques (Nm) of surfaces on links, and of links on links; None where there are none."""
