"""Records sessions with the simulator as a transcript."""

import logging
import os
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from iiwa_sim.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.log import LineWriter
from iiwa_sim.protocols.krc4_xml import NO_MESSAGE
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL
from iiwa_sim.transcript.texts import TranscriptFault

logger = logging.getLogger(__name__)

UNSPEAKABLE = ("(too long)", NO_MESSAGE)
"""Texts of the dialogue for bytes that are not kept, and so cannot be sent again."""
_REALS = re.compile(r"-?\d+\.\d+( -?\d+\.\d+)*|Res .*R\d=.*")
"""A reply that has reals."""


class Lines:
    """Lines of a transcript for the lines of a dialogue, in their order.

    Clients are called client1, client2, ... in the order in which they come. Replies with reals are compared
    as numbers, all others word for word.
    """

    def __init__(self, protocols: Sequence[str], began_ns: int) -> None:
        """`protocols` are all there are; real time is counted from `began_ns`."""
        self._protocols = tuple(protocols)
        self._began_ns = began_ns
        self._names: dict[str, str] = {}  # of clients that are there
        self._clients = 0
        self._last_said = ""

    def line(self, entry: DialogueLine) -> str:
        """One of them, without its end."""
        times = f"[{entry.time_s:.3f} {(entry.instant_ns - self._began_ns) * 1e-9:.6f}]"
        if entry.mark is Direction.EVENT:
            return self._event(entry, times)
        name = self._name(entry.session)
        if entry.mark is Direction.ON_WIRE:
            return f"# {times} {name}: on the wire: {entry.text}"
        if entry.mark is Direction.FROM_CLIENT:
            mark, self._last_said = ">", entry.text  # its reply comes next
        else:
            mark = "<~" if _REALS.fullmatch(entry.text) else "<"
        hidden = "# " if self._last_said in UNSPEAKABLE else ""
        return f"{hidden}{times} {name}{mark} " + entry.text.replace("{", "\\x7b")

    def _event(self, entry: DialogueLine, times: str) -> str:
        if entry.text == "connected":
            manner = "" if entry.protocol == self._protocols[0] else f" in {entry.protocol}"
            return f"{times} {self._name(entry.session)} connects{manner}"
        if entry.text == "disconnected":
            name = self._name(entry.session)
            del self._names[entry.session]
            return f"{times} {name} leaves"
        return f"# {times} {entry.session}: {entry.text}"

    def _name(self, session: str) -> str:
        if session not in self._names:
            self._clients += 1
            self._names[session] = f"client{self._clients}"
        return self._names[session]


@contextmanager
def recorded(
    path: Path, dialogue: Dialogue, title: str, protocols: Sequence[str] = (DEFAULT_PROTOCOL,)
) -> Iterator[None]:
    """Write a dialogue into a file, line by line, while the context is open.

    If the file cannot be written, as on a full disk, the log says so at the end. A FIFO or a terminal is
    never waited for: lines that it does not take are dropped, and a comment tells how many. `title` is the
    first line. Raises TranscriptFault if the file cannot be opened.
    """
    # Opening a FIFO for writing only would wait for a reader.
    how = os.O_RDWR if path.is_fifo() else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
    try:
        descriptor = os.open(path, how | os.O_NOCTTY | os.O_CLOEXEC, 0o666)
    except OSError as fault:
        raise TranscriptFault(f"{path}: cannot be written: {fault.strerror}") from None
    lines = Lines(protocols, time.monotonic_ns())
    out = LineWriter(descriptor, b"# %d lines lost: not read in time\n")
    named = "" if tuple(protocols) == (DEFAULT_PROTOCOL,) else f"protocol {','.join(protocols)}\n"
    header = f"# {title}\n# [simulated real] time in s\n{named}"
    out.put(header.encode("ascii", "backslashreplace"))

    def write(entry: DialogueLine) -> None:
        out.put(f"{lines.line(entry)}\n".encode("ascii", "backslashreplace"))

    dialogue.listeners.append(write)
    try:
        yield
    finally:
        dialogue.listeners.remove(write)
        written = out.close()
        if out.fault is not None:
            logger.error("%s: the transcript is not whole: %s", path, out.fault.strerror)
        if written:
            os.close(descriptor)
        else:  # the thread that waits for the file still uses it
            logger.warning("%s: the last lines are lost: they were not read", path)
