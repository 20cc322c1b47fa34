"""The log on stderr: one line per event, plain or as JSON.

Everything goes through the standard library's logging. Only the command line calls `configure`: a program
that uses the simulator as a library configures logging itself. Levels: `warning` for rejected commands, for
clients that are dropped, vanish while the robot moves, or send no more servo commands, and for forces that
end a move; `info` for clients that connect and disconnect; `debug` for the dialogue.
"""

import json
import logging
import os
import queue
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime

from iiwa_sim.wording import harmless

REFUSALS_LOGGED = 20
"""Refusals logged per second for one session and one code."""
SECOND_NS = 1_000_000_000
MOST_LINES = 4096
"""Most lines that wait to be written; further ones are dropped."""
PATIENCE_S, LOOKS_S = 1.0, 0.002
"""Seconds for which `flush`, and so the end of the program, waits for a file that blocks; between looks."""

logger = logging.getLogger(__name__)

robot: ContextVar[str] = ContextVar("robot", default="")
"""Name of the robot that lines are about, in a process with several.
Tasks and callbacks that are set up in an asyncio loop inherit the present value."""


@contextmanager
def named(name: str) -> Iterator[None]:
    """Have log lines, and those of tasks that begin meanwhile, carry the name of a robot; empty for none."""
    before = robot.set(name)
    try:
        yield
    finally:
        robot.reset(before)


class Throttle:
    """Filter that admits the first few events of each kind in a second, for a readable log."""

    def __init__(self, most: int) -> None:
        self._most, self._until_ns, self._counts = most, 0, Counter[Hashable]()

    def count(self, kind: Hashable, now_ns: int) -> int | None:
        """Return the number of this event in its second, from 1; None for one that is not admitted."""
        if now_ns >= self._until_ns:
            self._until_ns, self._counts = now_ns + SECOND_NS, Counter()
        self._counts[kind] += 1
        return self._counts[kind] if self._counts[kind] <= self._most else None


class SessionLog:
    """The log of sessions. It writes to logging.

    For each session and code the first `REFUSALS_LOGGED` in a second are logged, at debug level all.
    """

    def __init__(self, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.on_refused: list[Callable[[str, str, int, str], None]] = []
        """Called with every refusal, also those not logged: session, line, code and reason."""
        self._now_ns, self._refusals = now_ns, Throttle(REFUSALS_LOGGED)

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        for listener in self.on_refused:
            listener(session, line, code, reason)
        text = f"{session} refused '{line}': {reason}"
        if not logger.isEnabledFor(logging.DEBUG):
            count = self._refusals.count((session, code), self._now_ns())
            if count is None:
                return
            if count == REFUSALS_LOGGED:
                text += f" (further ones with code {code} in this second are not logged)"
        _say(logging.WARNING, text, session=session, line=line, code=code, reason=reason)

    def odd(self, session: str, command: str, remark: str) -> None:
        text = f"{session} '{command}' is carried out, but {remark}; this is logged once"
        _say(logging.WARNING, text, session=session, command=command, remark=remark)

    def stopped(self, session: str, vanished: bool) -> None:
        went = "vanished" if vanished else "said bye"
        text = f"{session} {went} while the robot moved: it stops and forgets the moves that wait"
        _say(logging.WARNING if vanished else logging.INFO, text, session=session)

    def exception(self, session: str, line: str, fault: Exception) -> None:
        _say(logging.ERROR, f"{session} internal error at '{line}'", fault, session=session, line=line)


def _say(level: int, text: str, fault: Exception | None = None, **fields: object) -> None:
    logger.log(level, "%s", text, exc_info=fault, extra={"fields": fields})


def configure(level: str, as_json: bool) -> None:
    """Log to stderr: our lines of `level` or above; of other loggers, such as asyncio's, from warnings on."""
    if sys.stderr is None:  # closed: its number may be that of another file
        return
    handler = _Handler(sys.stderr.fileno(), as_json)
    ours = logging.getLogger("iiwa_sim")
    ours.setLevel(level.upper())
    logging.basicConfig(level=max(ours.level, logging.WARNING), handlers=[handler], force=True)


class LineWriter:
    """Writer of lines in a daemon thread, the only one that waits for the file.

    Lines for which there is no room are dropped; the line `lost` has their number when writing continues.
    """

    def __init__(self, descriptor: int, lost: bytes = b'{"lines lost": %d}\n') -> None:
        self.fault: OSError | None = None
        """The last error of the file."""
        self._descriptor, self._tells, self._lost = descriptor, lost, 0
        self._lines: queue.Queue[bytes] = queue.Queue(MOST_LINES)
        threading.Thread(target=self._write, name="iiwa-sim-writer", daemon=True).start()

    def put(self, line: bytes) -> None:
        """Queue a line with its end."""
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._lost += 1

    def flush(self) -> bool:
        """Wait until all is written, up to PATIENCE_S; return True if it is."""
        until_s = time.monotonic() + PATIENCE_S
        while self._lines.unfinished_tasks and time.monotonic() < until_s:
            time.sleep(LOOKS_S)
        return not self._lines.unfinished_tasks

    def close(self) -> bool:
        """Flush, and end the thread; return False if the file blocks. The file stays open."""
        if done := self.flush():
            self.put(b"")
        return done

    def _write(self) -> None:
        while line := self._lines.get():
            lost, self._lost = self._lost, 0
            rest = line + (self._tells % lost if lost else b"")
            while rest:
                try:
                    rest = rest[os.write(self._descriptor, rest) :]
                except BlockingIOError:  # the descriptor is non-blocking
                    time.sleep(LOOKS_S)
                except OSError as fault:
                    self.fault, rest = fault, b""
            self._lines.task_done()


class _Handler(logging.Handler):
    """Handler that drops lines rather than block the robot in mid-motion, if stderr is not read."""

    def __init__(self, descriptor: int, as_json: bool) -> None:
        super().__init__()
        self._as_json, self._writer = as_json, LineWriter(descriptor)

    def emit(self, record: logging.LogRecord) -> None:
        self._writer.put(self.format(record).encode() + b"\n")

    def flush(self) -> None:
        self._writer.flush()

    def format(self, record: logging.LogRecord) -> str:
        """Return `12:34:56.789 warning robot-1 MESSAGE` with the traceback indented below; or all in JSON."""
        level, name, text = record.levelname.lower(), robot.get(), record.getMessage()
        when = datetime.fromtimestamp(record.created, UTC)
        trace = logging.Formatter().formatException(record.exc_info) if record.exc_info else ""
        if self._as_json:
            event = {"time": when.isoformat(timespec="milliseconds"), "level": level}
            event |= {"robot": name} if name else {}
            event |= {"message": text, **getattr(record, "fields", {})}
            return json.dumps(event | ({"traceback": trace} if trace else {}))
        clock = when.astimezone().isoformat(" ", "milliseconds")[11:23]
        below = "".join(f"\n    {harmless(line)}" for line in trace.splitlines())
        return f"{clock} {level} {name and f'{name} '}{harmless(text)}{below}"
