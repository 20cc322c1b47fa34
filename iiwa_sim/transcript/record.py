"""Sessions with the simulator, written down as a transcript while they happen."""

import logging
import os
import stat
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from iiwa_sim.dialect.krc4.short import NO_MESSAGE
from iiwa_sim.dialect.ports import DEFAULT_DIALECT, KRC4
from iiwa_sim.dialect.wire.dialogue import Dialogue, Direction
from iiwa_sim.dialect.wire.dialogue import Said as Told
from iiwa_sim.dialect.wire.table import load_table
from iiwa_sim.never_waiting import NeverWaiting
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.krc4 import answers_reals

UNSPEAKABLE = ("(too long)", NO_MESSAGE)
"""What the dialogue tells of what is not known, and so cannot be said again."""

logger = logging.getLogger(__name__)


class Recorder:
    """Writes what a dialogue tells into a file, line by line; a listener while its context is open.

    Clients are called client1, client2, ... in the order in which they come. Replies of numbers are recorded
    as numbers, all others as they are. A file that takes no more, such as on a full disk, ends the recording
    with a line in the log, and nothing else. For a FIFO or a terminal nothing waits: lines that it does not
    take are lost, and a comment says how many.
    """

    def __init__(
        self,
        path: Path,
        dialogue: Dialogue,
        tick_s: float,
        title: str,
        dialects: Sequence[str] = (DEFAULT_DIALECT,),
    ) -> None:
        """`tick_s` is the robot's tick; `title` is the first line, a comment; `dialects` are all there are.

        Raises TranscriptFault.
        """
        self._dialogue = dialogue
        self._tick_s = tick_s
        self._path = path
        self._began_ns = time.monotonic_ns()
        self._names: dict[str, str] = {}
        self._usual_dialect = dialects[0]
        self._dialects: dict[str, str] = {}  # of clients that are there
        self._clients = 0
        self._last_said = ""
        self._broken = False
        self._table = load_table("iiwa")
        header = f"# {title}\n# [simulated real] time in s\n"
        if tuple(dialects) != (DEFAULT_DIALECT,):
            header += f"dialect {','.join(dialects)}\n"
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
        """Hears no more; what the context does at its end."""
        self._dialogue.listeners.remove(self._hear)
        taken = self._out.close()
        if self._out.fault is not None and not self._broken:
            self._break(self._out.fault)
        if taken:  # else the thread that waits for it still has it
            os.close(self._descriptor)

    def _hear(self, told: Told) -> None:
        if self._broken:
            return
        real_s = (told.instant_ns - self._began_ns) * 1e-9
        times = f"[{told.tick * self._tick_s:.3f} {real_s:.6f}]"
        if self._out.fault is None:
            self._out.put(_bytes(self._line(told, times) + "\n"))
        else:
            self._break(self._out.fault)

    def _break(self, fault: OSError) -> None:
        logger.error("%s: the transcript ends here: %s", self._path, fault.strerror)
        self._broken = True

    def _line(self, told: Told, times: str) -> str:
        if told.direction is Direction.EVENT:
            return self._event(told, times)
        name = self._name(told.session)
        if told.direction is Direction.ON_WIRE:
            return f"# {times} {name}: on the wire: {told.text}"
        text = told.text.replace("{", "\\x7b")
        if told.direction is Direction.FROM_CLIENT:
            self._last_said = told.text  # its reply comes next
        hidden = "# " if self._last_said in UNSPEAKABLE else ""
        mark = ">" if told.direction is Direction.FROM_CLIENT else self._mark(told.session, told.text)
        return f"{hidden}{times} {name}{mark} {text}"

    def _event(self, told: Told, times: str) -> str:
        if told.text == "connected":
            self._dialects[told.session] = told.dialect
            manner = "" if told.dialect == self._usual_dialect else f" in {told.dialect}"
            return f"{times} {self._name(told.session)} connects{manner}"
        if told.text == "disconnected":
            name = self._name(told.session)
            del self._names[told.session]
            self._dialects.pop(told.session, None)
            return f"{times} {name} leaves"
        return f"# {times} {told.session}: {told.text}"

    def _mark(self, session: str, reply: str) -> str:
        if self._dialects.get(session, self._usual_dialect) == KRC4:
            return "<~" if answers_reals(reply) else "<"
        command = self._table.find(self._last_said.partition(":")[0].encode())
        of_numbers = command is not None and command.reply_values and not command.reply_values[0].integer
        return "<~" if of_numbers and reply != "error" else "<"

    def _name(self, session: str) -> str:
        if session not in self._names:
            self._clients += 1
            self._names[session] = f"client{self._clients}"
        return self._names[session]


def _opened(path: Path) -> int:
    """For writing; a FIFO also for reading, or this would wait until somebody else does that."""
    is_fifo = path.exists() and stat.S_ISFIFO(path.stat().st_mode)
    how = os.O_RDWR if is_fifo else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
    return os.open(path, how | os.O_NOCTTY | os.O_CLOEXEC, 0o666)


def _may_wait(descriptor: int) -> bool:
    return stat.S_ISFIFO(os.fstat(descriptor).st_mode) or os.isatty(descriptor)


def _bytes(text: str) -> bytes:
    return text.encode("ascii", "backslashreplace")


def _lost(count: int) -> bytes:
    return b"# %d lines lost: nobody read them\n" % count
