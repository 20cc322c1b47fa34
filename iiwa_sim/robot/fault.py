"""The error of a robot's folder."""

from iiwa_sim.settings import SettingsFault


class RobotFault(SettingsFault):
    """A robot cannot be used as its folder describes it.

    The message is one line that names the file, the key, its value and what was expected.
    """
