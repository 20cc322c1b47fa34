"""What the ROS side may lack."""


class RosFault(Exception):
    """What the ROS side needs and does not find. The message is one line."""
