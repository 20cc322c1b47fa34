"""The errors of the ROS side."""

from iiwa_sim.wording import Unusable


class RosFault(Unusable):
    """A library or service that the ROS side needs is missing, or there can be no node. The message is one
    line."""
