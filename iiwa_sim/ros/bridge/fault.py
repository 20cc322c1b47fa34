"""The error of a bridge."""

from iiwa_sim.wording import Unusable


class BridgeFault(Unusable):
    """The robot cannot be reached. The message is one line."""
