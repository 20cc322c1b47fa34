"""What the ROS side may lack."""

from iiwa_sim.wording import Unusable


class RosFault(Unusable):
    """What the ROS side needs and does not find. The message is one line."""
