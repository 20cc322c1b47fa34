"""The process that writes recordings: one for all of a robot's process, started with the first of them.

A thread would do, but for the interpreter's lock: whoever asks the robot while it writes would wait for it. A
recording is given to the process as two descriptors, of a socket and of the file. It ends when this process
does, and makes the files whole that are open then.
"""

import atexit
import os
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from io import FileIO
from pathlib import Path
from weakref import WeakSet

from iiwa_sim.recordings.fault import RecordingFault

ENDS_S = 5.0
"""How long the process may take to end (s) once it has to."""
_BEGINNING = """
import runpy, sys
*found, package, module, descriptor, process = sys.argv[1:]
sys.path += found
sys.path.insert(0, package)
import iiwa_sim
del sys.path[0]
sys.argv[1:] = descriptor, process
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""
"""The library comes from where it is here, and so does what it needs, as far as this Python does not have it
by itself: modules of a user's that are called as one of Python's (`random.py` beside a test) come last."""


class WritingProcess:
    """One that has been started."""

    def __init__(self) -> None:
        """Start it. Raises OSError."""
        self.of = os.getpid()
        """The process that it belongs to; not to those forked off it."""
        self.hangs = False
        """Whether it has been waited for in vain."""
        self._given: WeakSet[socket.socket] = WeakSet()
        self._control, theirs = socket.socketpair()
        found: list[object] = [*sys.path]  # what is no text Python leaves out, too
        with theirs:
            try:
                self._process = subprocess.Popen(
                    [
                        *(sys.executable, "-I", "-c", _BEGINNING),
                        *(each for each in found if isinstance(each, str)),
                        str(Path(__file__).parents[2]),
                        *("iiwa_sim.recordings", f"{theirs.fileno()}", f"{self.of}"),
                    ],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    pass_fds=(theirs.fileno(),),
                    start_new_session=True,  # Ctrl-C, and what ends this process, are not for it
                )
            except OSError:
                self._control.close()
                raise

    @property
    def number(self) -> int:
        """The number of the process in the system."""
        return self._process.pid

    @property
    def computed(self) -> int | None:
        """CPU time that it has had so far, in ticks of the system's; None where that is not known."""
        try:
            fields = Path(f"/proc/{self.number}/stat").read_bytes().rpartition(b")")[2].split()
            return int(fields[11]) + int(fields[12])
        except (OSError, IndexError):
            return None

    @property
    def there(self) -> bool:
        """Whether it can be given something."""
        return self.of == os.getpid() and self._process.poll() is None

    def take(self, stream: FileIO) -> socket.socket:
        """Have it write a recording into a file; gives a socket for the frames, and for its signs.

        Raises OSError, where it has ended meanwhile.
        """
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                socket.send_fds(self._control, [b"r"], [theirs.fileno(), stream.fileno()])
        except OSError:
            ours.close()
            raise
        self._given.add(ours)
        return ours

    def why_it_ended(self) -> str:
        """What became of it, when it says no more."""
        try:
            code = self._process.wait(ENDS_S)
        except subprocess.TimeoutExpired:
            return "the process that writes it says no more"
        how = f"was killed by signal {-code}" if code < 0 else f"has ended with exit code {code}"
        return f"the process that writes it {how}"

    def end(self) -> None:
        """Have it end, with this process; waited for unless it hangs, or still has something to write."""
        self._control.close()
        if self.there and not self.hangs and not any(given.fileno() >= 0 for given in self._given):
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(ENDS_S)


_lock = threading.Lock()
_started: list[WritingProcess] = []
"""The last one is the present one; those before have ended, or belong to the process this was forked off."""


def given_to_write(path: Path, stream: FileIO) -> tuple[WritingProcess, socket.socket]:
    """Have a recording written into a file that is open; gives who does so, and the socket for its frames.

    Raises RecordingFault where no process can be started.
    """
    with _lock:
        try:
            if _started and _started[-1].there:
                with suppress(OSError):  # it is about to end
                    return _started[-1], _started[-1].take(stream)
            started = WritingProcess()
            atexit.register(started.end)
            _started.append(started)
            return started, started.take(stream)
        except OSError as fault:
            raise RecordingFault(f"{path}: no process to write it can be started: {fault.strerror}") from None
