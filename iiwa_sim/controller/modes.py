"""The modes of the robot, and what each kind of command does in each of them.

Appendix B of drag&bot's requirements has four modes, normal, impedance, smart and direct, each with its own
commands; a change between them stops the robot for about 100 ms. Our decisions: the robot is in none of them,
called unknown, before its first command and after a stop; joint trajectories of ROS have a fifth.
"""

from enum import Enum
from typing import NamedTuple


class Mode(Enum):
    """Mode of the robot; the values are the words on the wire."""

    UNKNOWN = "unknown"
    NORMAL = "normal"
    IMPEDANCE = "impedance"
    SMART = "smart"
    DIRECT = "direct"
    TRAJECTORY = "trajectory"


class Event(Enum):
    """Event that may change the mode. A rejected command is no event."""

    NORMAL_MOVE = "normal move"
    IMPEDANCE_MOVE = "impedance move"
    SMART_MOVE = "smart move"
    DIRECT_MOVE = "direct move"
    TRAJECTORY = "trajectory"
    STOP = "stop"
    SERVO_TIMEOUT = "servo timeout"


class Transition(NamedTuple):
    """Effect of an event."""

    mode: Mode
    """The mode from now on."""
    stops: bool
    """True if the robot stops on its path and forgets waiting moves. What the event asks for begins when
    the robot is at rest."""


# A cell holds the mode after the event, and "stop" before it where the robot has to come to rest first.
_GRID = """
mode      |normal move |impedance move |smart move |direct move |trajectory      |stop         |servo timeout
unknown   |normal      |impedance      |smart      |direct      |trajectory      |unknown      |unknown
normal    |normal      |stop, impedance|stop, smart|stop, direct|stop, trajectory|stop, unknown|normal
impedance |stop, normal|impedance      |stop, smart|stop, direct|stop, trajectory|stop, unknown|impedance
smart     |stop, normal|stop, impedance|smart      |stop, direct|stop, trajectory|stop, unknown|stop, unknown
direct    |stop, normal|stop, impedance|stop, smart|direct      |stop, trajectory|stop, unknown|stop, unknown
trajectory|stop, normal|stop, impedance|stop, smart|stop, direct|trajectory      |stop, unknown|trajectory
"""
SERVO_MODES = (Mode.SMART, Mode.DIRECT)


def _read(grid: str) -> dict[tuple[Mode, Event], Transition]:
    head, *rows = [[cell.strip() for cell in line.split("|")] for line in grid.strip().splitlines()]
    return {
        (Mode(mode), Event(event)): Transition(Mode(cell.removeprefix("stop, ")), cell.startswith("stop, "))
        for mode, *cells in rows
        for event, cell in zip(head[1:], cells, strict=True)
    }


TRANSITIONS = _read(_GRID)
"""The effect of every event in every mode."""
