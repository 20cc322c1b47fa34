"""Records sessions with the simulator as a transcript."""

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
from iiwa_sim.dialect.wire.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.dialect.wire.table import load_table
from iiwa_sim.never_waiting import NeverWaiting
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.krc4 import answers_reals

UNSPEAKABLE = ("(too long)", NO_MESSAGE)
"""Texts in the dialogue for lines whose contents are not known, so that they cannot be replayed."""

logger = logging.getLogger(__name__)


class Recorder:
    """Writes a dialogue into a file, line by line; it listens while its context is open.

    Clients are called client1, client2, ... in the order in which they connect. Replies of numbers are
    recorded as numbers, others verbatim. If the file cannot be written, as on a full disk, the recording ends
    with a line in the log. A FIFO or a terminal is never waited for: lines that it does not take are dropped,
    and a comment tells how many.
    """

    def __init__(
        self,
        path: Path,
        dialogue: Dialogue,
        tick_s: float,
        title: str,
        dialects: Sequence[str] = (DEFAULT_DIALECT,),
    ) -> None:
        """`tick_s` is the duration of a tick (s); `title` is the first line, a comment; `dialects` are those
        of the simulator.

        Raises TranscriptFault.
        """
        self._dialogue = dialogue
        self._tick_s = tick_s
        self._path = path
        self._began_ns = time.monotonic_ns()
        self._names: dict[str, str] = {}
        self._usual_dialect = dialects[0]
        self._dialects: dict[str, str] = {}  # of connected clients
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
        """Stop listening; the context does so at its end."""
        self._dialogue.listeners.remove(self._hear)
        written = self._out.close()
        if self._out.fault is not None and not self._broken:
            self._break(self._out.fault)
        if written:  # otherwise the thread that waits for the file still uses it
            os.close(self._descriptor)

    def _hear(self, said: DialogueLine) -> None:
        if self._broken:
            return
        real_s = (said.instant_ns - self._began_ns) * 1e-9
        times = f"[{said.tick * self._tick_s:.3f} {real_s:.6f}]"
        if self._out.fault is None:
            self._out.put(_bytes(self._line(said, times) + "\n"))
        else:
            self._break(self._out.fault)

    def _break(self, fault: OSError) -> None:
        logger.error("%s: the transcript ends here: %s", self._path, fault.strerror)
        self._broken = True

    def _line(self, said: DialogueLine, times: str) -> str:
        if said.direction is Direction.EVENT:
            return self._event(said, times)
        name = self._name(said.session)
        if said.direction is Direction.ON_WIRE:
            return f"# {times} {name}: on the wire: {said.text}"
        text = said.text.replace("{", "\\x7b")
        if said.direction is Direction.FROM_CLIENT:
            self._last_said = said.text  # its reply comes next
        hidden = "# " if self._last_said in UNSPEAKABLE else ""
        mark = ">" if said.direction is Direction.FROM_CLIENT else self._mark(said.session, said.text)
        return f"{hidden}{times} {name}{mark} {text}"

    def _event(self, said: DialogueLine, times: str) -> str:
        if said.text == "connected":
            self._dialects[said.session] = said.dialect
            dialect = "" if said.dialect == self._usual_dialect else f" in {said.dialect}"
            return f"{times} {self._name(said.session)} connects{dialect}"
        if said.text == "disconnected":
            name = self._name(said.session)
            del self._names[said.session]
            self._dialects.pop(said.session, None)
            return f"{times} {name} leaves"
        return f"# {times} {said.session}: {said.text}"

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
