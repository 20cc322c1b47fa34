"""`iiwa-sim` and its subcommands, which `names.py` lists: options, exit codes.

Exit code 0 after SIGTERM or SIGINT, after a bye that ends the run, and for a subcommand that succeeds; 1
where a check fails; 2, with one line on stderr, for options, a cell, a robot, an address, a stdout or a file
that cannot be used, and for refused commands of a picture.
"""

import gc
import signal
import sys
from collections.abc import Sequence
from importlib import import_module

from iiwa_sim.cli.early import end_while_loading, one_thread
from iiwa_sim.cli.names import SERVE, SUBCOMMANDS, module_of
from iiwa_sim.wording import Unusable

WITHOUT_WHEELS = {
    "pinocchio": "pip install pin; for Windows it has no wheels: take WSL 2 or the container image",
    "ruckig": "pip install ruckig; on ARM Linux pip compiles it with a C++ compiler: apt install g++",
}
"""Libraries without wheels for every platform, with a hint for each."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGTERM or SIGINT, or a subcommand; returns the exit code.

    Without `arguments` the command line is used, and SIGTERM and SIGINT end the process while it loads.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    name = given.pop(0) if given and given[0] in SUBCOMMANDS else SERVE
    if arguments is None:
        one_thread()
        if name == SERVE:
            end_while_loading()
            gc.disable()  # objects made during the start are long-lived; enabled when the robots listen
    try:
        # Only the subcommand is imported: others may need an extra, and importing all takes time.
        code: int = import_module(module_of(name)).run(given)
        return code
    except Unusable as fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
        return 2
    except ModuleNotFoundError as fault:
        if fault.name not in WITHOUT_WHEELS:
            raise
        print(f"iiwa-sim: {fault.name} is not installed: {WITHOUT_WHEELS[fault.name]}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # raised in a subcommand
        return 128 + signal.SIGINT
