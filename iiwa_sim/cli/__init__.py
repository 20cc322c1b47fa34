"""`iiwa-sim` and its commands: options, exit codes.

Exit code 0: after SIGTERM or SIGINT, after a bye that ends the run, and for a command that succeeds.
Exit code 1: a check has failed. Exit code 2, with one line on stderr: options, a cell, a robot, an address or
a file cannot be used, a command of a picture was rejected, or stdout cannot be written.
"""

import errno
import gc
import os
import signal
import sys
import textwrap
from collections.abc import Sequence

from iiwa_sim.wording import Unusable

COMMANDS = {
    "plot": "draw a motion, of a file of commands or a recording",
    "check-cell": "print what is in a cell, or what is wrong with it",
    "replay": "play a transcript against a server, and report replies that differ",
    "show": "play a recording on a web page, with a time line",
    "check": "report how a server deviates from the original controller",
    "health": "tell by the exit code if the iiwa-sim of a container answers",
    "ros2-env": "make an environment with rclpy for --ros2, from wheels",
}
"""The first arguments that select a command, and what each does."""
STDOUT_FAULTS = {errno.EPIPE: "stdout has no reader", errno.ENOSPC: "the disk of stdout is full"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGTERM or SIGINT, or a command; returns the exit code.

    Without `arguments` the command line is used, and SIGTERM and SIGINT end the process while it loads.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    command = words.pop(0) if words and words[0] in COMMANDS else ""
    if arguments is None:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's arrays are small, and threads cost time
        if not command:
            for number in (signal.SIGTERM, signal.SIGINT):  # process 1 of a container has no default for them
                # Nothing is open yet; sys.exit would tear down half loaded libraries, and Pinocchio crash.
                signal.signal(number, lambda *_: os._exit(0))
            gc.disable()  # objects made during the start are long-lived; enabled when the robots listen
    try:
        code = _run(command, words)
        print(end="", flush=True)  # a fault of stdout shows here
        return code
    except Unusable as fault:
        print(f"iiwa-sim: {fault}", file=sys.stderr)
        return 2
    except OSError as fault:
        if fault.errno not in STDOUT_FAULTS or fault.filename is not None:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or the flush at exit fails again
        print(f"iiwa-sim: {STDOUT_FAULTS[fault.errno]}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # raised in a command
        return 128 + signal.SIGINT


def _run(command: str, words: Sequence[str]) -> int:
    if not command:
        from iiwa_sim.cli.serve import run

        return run(words)
    from iiwa_sim.cli import commands
    from iiwa_sim.cli.parsing import Parser

    function = getattr(commands, command.replace("-", "_"))
    closing = textwrap.dedent(f"    {function.__doc__}")
    return int(function(Parser(command, COMMANDS[command], closing), words))
