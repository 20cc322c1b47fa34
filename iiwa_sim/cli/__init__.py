"""`iiwa-sim`, plot, check-cell, replay, check, bridge, health, ros-package-path: options, exit codes.

Exit code 0 after SIGTERM or SIGINT, a bye that is to end it, when the picture is written, the cell is right
or a server answers as expected; 1 where it does not; 2, with one line on stderr, for options, a cell, a
robot, an address, a stdout or a file it cannot use, and for commands of a picture that are refused.
"""

import signal
import sys
from collections.abc import Sequence

from iiwa_sim.bridge.fault import BridgeFault
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.cli.options import BRIDGE, CHECK, CHECK_CELL, HEALTH, PLOT, REPLAY, ROS_PACKAGE_PATH
from iiwa_sim.cli.output import StdoutFault
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.robot.description import RobotFault
from iiwa_sim.ros.fault import RosFault
from iiwa_sim.serve.listening import ListenFault
from iiwa_sim.transcript.fault import TranscriptFault


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGTERM or SIGINT, or what a subcommand asks for; returns the exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        if given and given[0] == PLOT:
            from iiwa_sim.cli import plot

            return plot.run(given[1:])
        if given and given[0] == CHECK_CELL:
            from iiwa_sim.cli import check_cell

            return check_cell.run(given[1:])
        if given and given[0] == REPLAY:
            from iiwa_sim.cli import replay

            return replay.run(given[1:])
        if given and given[0] == CHECK:
            from iiwa_sim.cli import check

            return check.run(given[1:])
        if given and given[0] == BRIDGE:
            from iiwa_sim.cli import bridge

            return bridge.run(given[1:])
        if given and given[0] == HEALTH:
            from iiwa_sim.cli import health

            return health.run(given[1:])
        if given and given[0] == ROS_PACKAGE_PATH:
            from iiwa_sim.cli import ros_package_path

            return ros_package_path.run(given[1:])
        from iiwa_sim.cli import serve

        return serve.run(given)
    except (
        BridgeFault,
        CellFault,
        RobotFault,
        ListenFault,
        PlotFault,
        RosFault,
        TranscriptFault,
        StdoutFault,
    ) as fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # in a subcommand
        return 128 + signal.SIGINT
