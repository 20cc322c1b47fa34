"""What can be wrong with the robot of a bridge."""


class BridgeFault(Exception):
    """A robot that cannot be reached. The message is one line."""
