"""Sessions with the simulator, written down as a transcript while they happen."""

import contextlib
import logging
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from iiwa_sim.dialect.dialogue import Dialogue, Direction
from iiwa_sim.dialect.dialogue import Said as Told
from iiwa_sim.dialect.krc4_short import NO_MESSAGE
from iiwa_sim.dialect.ports import DEFAULT_DIALECT, KRC4
from iiwa_sim.dialect.table import load_table
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.krc4 import answers_reals

UNSPEAKABLE = ("(too long)", NO_MESSAGE)
"""What the dialogue tells of what is not known, and so cannot be said again."""

logger = logging.getLogger(__name__)


class Recorder:
    """Writes what a dialogue tells into a file, line by line; a listener while its context is open.

    Clients are called client1, client2, ... in the order in which they come. Replies of numbers are recorded
    as numbers, all others as they are. A file that takes no more, such as on a full disk, ends the recording
    with a line in the log, and nothing else.
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
        try:
            self._file = path.open("w", encoding="ascii", errors="backslashreplace", buffering=1)
            try:
                self._file.write(f"# {title}\n# [simulated real] time in s\n")
                if tuple(dialects) != (DEFAULT_DIALECT,):
                    self._file.write(f"dialect {','.join(dialects)}\n")
            except OSError:
                self._close()
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
        self._close()

    def _hear(self, told: Told) -> None:
        if self._broken:
            return
        real_s = (told.instant_ns - self._began_ns) * 1e-9
        times = f"[{told.tick * self._tick_s:.3f} {real_s:.6f}]"
        try:
            self._file.write(self._line(told, times) + "\n")
        except OSError as fault:
            logger.error("%s: the transcript ends here: %s", self._path, fault.strerror)
            self._broken = True

    def _close(self) -> None:
        with contextlib.suppress(OSError):  # of what a full disk has not taken
            self._file.close()

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
