"""`iiwa-sim`, plot, check-cell, replay, check, bridge, health, ros-package-path: options, exit codes.

Exit code 0 after SIGTERM or SIGINT, a bye that is to end it, when the picture is written, the cell is right
or a server answers as expected; 1 where it does not; 2, with one line on stderr, for options, a cell, a
robot, an address, a stdout or a file it cannot use, and for commands of a picture that are refused.
"""

import signal
import sys
from collections.abc import Sequence
from importlib import import_module

from iiwa_sim.bridge.fault import BridgeFault
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.cli.options import SUBCOMMANDS
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
        if given and given[0] in SUBCOMMANDS:
            # Only what is asked for is imported: it may need an extra, and all of it takes a while.
            subcommand = import_module(f"iiwa_sim.cli.{given[0].replace('-', '_')}")
            code: int = subcommand.run(given[1:])
            return code
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
