"""What can be wrong with the robot of a bridge."""

from iiwa_sim.wording import Unusable


class BridgeFault(Unusable):
    """A robot that cannot be reached. The message is one line."""
