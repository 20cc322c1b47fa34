"""Records sessions with the simulator as a transcript."""

import logging
import os
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from iiwa_sim.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.line_writer import LineWriter
from iiwa_sim.protocols.krc4_xml import NO_MESSAGE
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL, KRC4
from iiwa_sim.protocols.table import load_table
from iiwa_sim.transcript.texts import TranscriptFault, answers_reals

logger = logging.getLogger(__name__)

UNSPEAKABLE = ("(too long)", NO_MESSAGE)
"""Texts of the dialogue for bytes that are not kept, and so cannot be sent again."""


class Lines:
    """Lines of a transcript for the lines of a dialogue, in their order.

    Clients are called client1, client2, ... in the order in which they come. Replies of numbers are written
    as numbers, all others as they are.
    """

    def __init__(self, protocols: Sequence[str], began_ns: int) -> None:
        """`protocols` are all there are; real time is counted from `began_ns`."""
        self._protocols_there = tuple(protocols)
        self._began_ns = began_ns
        self._names: dict[str, str] = {}
        self._usual_protocol = protocols[0]
        self._protocols: dict[str, str] = {}  # of clients that are there
        self._clients = 0
        self._last_said = ""
        self._table = load_table("iiwa")

    def header(self, title: str) -> str:
        """Return the head of a transcript with its line ends; `title` is the first line, a comment."""
        header = f"# {title}\n# [simulated real] time in s\n"
        if self._protocols_there != (DEFAULT_PROTOCOL,):
            header += f"protocol {','.join(self._protocols_there)}\n"
        return header

    def line(self, told: DialogueLine, simulated_s: float) -> str:
        """One of them, without its end."""
        times = f"[{simulated_s:.3f} {(told.instant_ns - self._began_ns) * 1e-9:.6f}]"
        if told.direction is Direction.EVENT:
            return self._event(told, times)
        name = self._name(told.session)
        if told.direction is Direction.ON_WIRE:
            return f"# {times} {name}: on the wire: {told.text}"
        mark = ">"
        if told.direction is Direction.FROM_CLIENT:
            self._last_said = told.text  # its reply comes next
        else:
            mark = self._mark(told.session, told.text)
        hidden = "# " if self._last_said in UNSPEAKABLE else ""
        return f"{hidden}{times} {name}{mark} " + told.text.replace("{", "\\x7b")

    def _event(self, told: DialogueLine, times: str) -> str:
        if told.text == "connected":
            self._protocols[told.session] = told.protocol
            manner = "" if told.protocol == self._usual_protocol else f" in {told.protocol}"
            return f"{times} {self._name(told.session)} connects{manner}"
        if told.text == "disconnected":
            name = self._name(told.session)
            del self._names[told.session]
            self._protocols.pop(told.session, None)
            return f"{times} {name} leaves"
        return f"# {times} {told.session}: {told.text}"

    def _mark(self, session: str, reply: str) -> str:
        if self._protocols.get(session, self._usual_protocol) == KRC4:
            return "<~" if answers_reals(reply) else "<"
        command = self._table.find(self._last_said.partition(":")[0].encode())
        of_numbers = command is not None and command.reply.values and not command.reply.values[0].integer
        return "<~" if of_numbers and reply != "error" else "<"

    def _name(self, session: str) -> str:
        if session not in self._names:
            self._clients += 1
            self._names[session] = f"client{self._clients}"
        return self._names[session]


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
        # Opening a FIFO for writing only would wait for a reader.
        how = os.O_RDWR if path.is_fifo() else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        try:
            self._descriptor = os.open(path, how | os.O_NOCTTY | os.O_CLOEXEC, 0o666)
        except OSError as fault:
            raise TranscriptFault(f"{path}: cannot be written: {fault.strerror}") from None
        self._out = LineWriter(self._descriptor, lambda n: b"# %d lines lost: nobody read them\n" % n)
        self._put(self._lines.header(title))

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
        self._check_fault()
        if written:
            os.close(self._descriptor)
        else:  # the thread that waits for the file still uses it
            logger.warning("%s: the last lines are lost: nobody read them", self._path)

    def _hear(self, said: DialogueLine) -> None:
        self._check_fault()
        if not self._broken:
            self._put(self._lines.line(said, said.tick * self._tick_s) + "\n")

    def _put(self, text: str) -> None:
        self._out.put(text.encode("ascii", "backslashreplace"))

    def _check_fault(self) -> None:
        if self._out.fault is not None and not self._broken:
            self._broken = True
            logger.error("%s: the transcript ends here: %s", self._path, self._out.fault.strerror)
