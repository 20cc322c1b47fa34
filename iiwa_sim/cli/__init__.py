"""`iiwa-sim`, plot, check-cell, replay, export, check, bridge, health, ros-package-path: options, exit codes.

Exit code 0 after SIGTERM or SIGINT, a bye that is to end it, when the picture is written, the cell is right
or a server answers as expected; 1 where it does not; 2, with one line on stderr, for options, a cell, a
robot, an address, a stdout or a file it cannot use, and for commands of a picture that are refused.
"""

import signal
import sys
from collections.abc import Sequence
from importlib import import_module

from iiwa_sim.cli.early import end_while_loading
from iiwa_sim.cli.names import BRIDGE, SERVE, SUBCOMMANDS
from iiwa_sim.wording import Unusable

WITHOUT_WHEELS = {
    "pinocchio": "pip install pin; for Windows it has no wheels: take WSL 2 or the container image",
    "ruckig": "pip install ruckig; on ARM Linux pip compiles it with a C++ compiler: apt install g++",
}
"""Libraries that are not to be had ready-made everywhere, and what to do about it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGTERM or SIGINT, or what a subcommand asks for; returns the exit code.

    Without arguments it is the program, with those of its command line.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    name = given.pop(0) if given and given[0] in SUBCOMMANDS else SERVE
    if arguments is None and name in (SERVE, BRIDGE):
        end_while_loading()
    try:
        # Only what is asked for is imported: it may need an extra, and all of it takes a while.
        code: int = import_module(f"iiwa_sim.cli.{name.replace('-', '_')}").run(given)
        return code
    except Unusable as fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
        return 2
    except ModuleNotFoundError as fault:
        if fault.name not in WITHOUT_WHEELS:
            raise
        print(f"iiwa-sim: {fault.name} is not installed: {WITHOUT_WHEELS[fault.name]}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # in a subcommand
        return 128 + signal.SIGINT
