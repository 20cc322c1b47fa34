"""Records sessions with the simulator as a transcript."""

import logging
import os
import stat
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from iiwa_sim.never_waiting import NeverWaiting
from iiwa_sim.protocols.dialogue import Dialogue, DialogueLine
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.written import Lines

logger = logging.getLogger(__name__)


class Recorder:
    """Writes a dialogue into a file, line by line; it listens while its context is open.

    If the file cannot be written, as on a full disk, the recording ends with a line in the log. A FIFO or a
    terminal is never waited for: lines that it does not take are dropped, and a comment tells how many.
    """

    def __init__(
        self,
        path: Path,
        dialogue: Dialogue,
        tick_s: float,
        title: str,
        protocols: Sequence[str] = (DEFAULT_PROTOCOL,),
    ) -> None:
        """`tick_s` is the duration of a tick (s); `title` is the first line, a comment; `protocols` are those
        of the simulator.

        Raises TranscriptFault.
        """
        self._dialogue = dialogue
        self._tick_s = tick_s
        self._path = path
        self._lines = Lines(protocols, time.monotonic_ns())
        self._broken = False
        header = self._lines.header(title)
        try:
            self._descriptor = _opened(path)
            self._out = NeverWaiting(self._descriptor, _lost)
            try:
                if _may_wait(self._descriptor):
                    self._out.put(_bytes(header))
                else:
                    os.write(self._descriptor, _bytes(header))
            except OSError:
                os.close(self._descriptor)
                raise
        except OSError as fault:
            raise TranscriptFault(f"{path}: cannot be written: {fault.strerror}") from None

    def __enter__(self) -> Self:
        self._dialogue.listeners.append(self._hear)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop listening; the context does so at its end."""
        self._dialogue.listeners.remove(self._hear)
        written = self._out.close()
        if self._out.fault is not None:
            if not self._broken:
                self._break(self._out.fault)
        elif untold := self._out.untold:
            logger.warning("%s: the last %d lines are lost: nobody read them", self._path, untold)
        if written:  # otherwise the thread that waits for the file still uses it
            os.close(self._descriptor)

    def _hear(self, said: DialogueLine) -> None:
        if self._broken:
            return
        if self._out.fault is None:
            self._out.put(_bytes(self._lines.line(said, said.tick * self._tick_s) + "\n"))
        else:
            self._break(self._out.fault)

    def _break(self, fault: OSError) -> None:
        logger.error("%s: the transcript ends here: %s", self._path, fault.strerror)
        self._broken = True


def _opened(path: Path) -> int:
    """Open for writing; a FIFO also for reading, as opening would otherwise wait for a reader."""
    is_fifo = path.exists() and stat.S_ISFIFO(path.stat().st_mode)
    how = os.O_RDWR if is_fifo else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
    return os.open(path, how | os.O_NOCTTY | os.O_CLOEXEC, 0o666)


def _may_wait(descriptor: int) -> bool:
    return stat.S_ISFIFO(os.fstat(descriptor).st_mode) or os.isatty(descriptor)


def _bytes(text: str) -> bytes:
    return text.encode("ascii", "backslashreplace")


def _lost(count: int) -> bytes:
    return b"# %d lines lost: nobody read them\n" % count
