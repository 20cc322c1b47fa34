"""The modes of the robot.

Appendix B of drag&bot's requirements has four modes: normal, impedance, smart and direct. Each has its own
commands; a change between them stops the robot for about 100 ms. Our decisions: the mode is `unknown` before
the first command and after a stop; joint trajectories of ROS have a mode of their own.
"""

from enum import Enum


class Mode(Enum):
    """Mode of the robot; the values are the words on the wire."""

    UNKNOWN = "unknown"
    NORMAL = "normal"
    IMPEDANCE = "impedance"
    SMART = "smart"
    DIRECT = "direct"
    TRAJECTORY = "trajectory"

    def stops_for(self, wanted: "Mode") -> bool:
        """Return True if a command of the `wanted` mode first stops the robot on its path.

        Waiting moves are then forgotten, and the command begins when the robot is at rest.
        """
        return self not in (Mode.UNKNOWN, wanted)


SERVO_MODES = (Mode.SMART, Mode.DIRECT)
