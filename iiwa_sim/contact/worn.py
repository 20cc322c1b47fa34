"""What an arm wears on its flange, tools and jaws, as contact sees it."""

from typing import NamedTuple

from iiwa_sim.robot.capsules import Capsule


class Worn(NamedTuple):
    """A capsule that is fixed to the flange."""

    capsule: Capsule
    """The capsule, in the flange."""
    share: float = 1.0
    """What it feels of a surface's stiffness: with others side by side a part of it."""
