"""A recording, as the robot's process has it: what is put is on its way to the process that writes the file.

Who puts waits for nothing and makes nothing: the bytes go into a socket, 10 to 30 us for 25 states.
"""

import contextvars
import logging
import select
import socket
import threading
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from iiwa_sim.recordings.handed import Beginning, Closed, Handed, Lost, frame_of, messages_in
from iiwa_sim.recordings.opening import opened
from iiwa_sim.recordings.process import ENDS_S, given_to_write
from iiwa_sim.recordings.signs import ALIVE, FAULT, LONGEST_SIGN, WHOLE

MOST_BYTES = 8 * 1024 * 1024
"""Most bytes that wait for the writing process, some 30 s of a robot at 500 Hz; what comes then is lost."""
SOCKET_BYTES = 1024 * 1024
"""Asked for, to be on the way; systems grant less."""
PATIENCE_S = 5.0
"""So long the file may take nothing, before who can wait, and the end of the recording, wait no longer."""
STARTS_S = 60.0
"""So long instead while the process has given no sign of life, where the system does not tell whether it
computes: it may take its time to start."""
_UNKNOWN = -1
_LOOK_S = 0.25
"""Time between two looks at what found no room before, where nobody puts any more."""
_NO_SIGNAL = getattr(socket, "MSG_NOSIGNAL", 0)
"""A program may have set SIGPIPE to kill it."""

logger = logging.getLogger(__name__)


class Writer:
    """Has messages written into a file by another process.

    Messages that find no room are lost and counted, which the log tells once, and the end of the file. A file
    that takes no more, such as on a full disk, ends the recording with one line in the log; so does a process
    that is killed.
    """

    def __init__(self, path: Path) -> None:
        """Raises RecordingFault for a file that cannot be written, or where no process can be started."""
        self.lost = 0
        """Messages, so far."""
        self._lost_told = 0
        self._path = path
        with opened(path) as stream:
            self._process, self._socket = given_to_write(path, stream)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SOCKET_BYTES)
        self._lock = threading.Lock()  # of what waits
        self._waiting: deque[memoryview] = deque()
        self._waiting_bytes = 0
        self._over = False  # nothing is written any more
        self._whole = False
        self._given_up = False
        self._stuck = False  # nothing was taken for so long that nobody waits any more
        self._sent = 0  # pieces
        self._signs = 0  # of life
        context = contextvars.copy_context()  # in which the log knows whose recording it is
        self._listener = threading.Thread(
            target=context.run, args=(self._listen,), name="iiwa-sim-recording", daemon=True
        )
        self._listener.start()

    def begin(self, beginning: Beginning) -> None:
        """Say what is to be known before the first message."""
        with self._lock:
            self._append(frame_of(beginning))

    @property
    def process(self) -> int:
        """The number of the process that writes."""
        return self._process.number

    def put(self, handed: Sequence[Handed], *, can_wait: bool = False) -> None:
        """Have something written. Where there is no room it waits, if it `can_wait`, or is lost."""
        if self._over or not handed:
            return
        if self.lost != self._lost_told:
            self._lost_told = self.lost
            handed = [*handed, Lost(self.lost)]
        frame = frame_of(handed)
        with self._lock:
            self._send()
            if can_wait:
                self._wait_for_room(len(frame))
            if self._waiting_bytes + len(frame) <= MOST_BYTES or not self._waiting:
                self._append(frame)
                return
        if not self._over:
            lost_none = not self.lost
            self.lost += messages_in(handed)
            if lost_none:
                logger.warning("%s: the recording loses messages: the file takes them too slowly", self._path)

    def close(self) -> bool:
        """Have the rest written, and the end of the file; whether it is whole."""
        with self._lock:
            self._append(frame_of([Lost(self.lost), Closed()]))
        while self._listener.is_alive():
            before = self._progress()
            if self._waiting:
                with self._lock:
                    self._wait_and_send()
                if self._over:  # found meanwhile: the thread is about to say why, and to end
                    continue
            else:
                with self._lock, suppress(OSError):  # it is over, and the thread about to end
                    self._socket.shutdown(socket.SHUT_WR)
                # The thread that is about to end may wait for the process's own end.
                self._listener.join(self._patience_s + (ENDS_S if self._over else 0.0))
            if self._listener.is_alive() and self._progress() == before:
                self._give_up()
                return False
        if self.lost:
            logger.warning("%s: the recording has lost %d messages", self._path, self.lost)
        return self._whole

    @property
    def _patience_s(self) -> float:
        return STARTS_S if self._starting() == _UNKNOWN else PATIENCE_S

    def _progress(self) -> tuple[int, int, int, bool]:
        return self._sent, self._signs, self._starting(), self._over

    def _starting(self) -> int:
        """How far the process has come that has given no sign of life yet, in CPU time; 0 once it has."""
        if self._signs:
            return 0
        computed = self._process.computed
        return _UNKNOWN if computed is None else computed

    def _append(self, frame: bytes) -> None:
        if self._over:
            return
        self._waiting.append(memoryview(frame))
        self._waiting_bytes += len(frame)
        self._send()

    def _send(self) -> None:
        """Hand on what finds room, of what waits."""
        while self._waiting and not self._over:
            piece = self._waiting[0]
            try:
                sent = self._socket.send(piece, _NO_SIGNAL)
            except BlockingIOError:
                return
            except OSError:  # nobody reads any more: why, the listener finds out
                self._drop()
                return
            self._sent += 1
            self._stuck = False
            self._waiting_bytes -= sent
            if sent < len(piece):
                self._waiting[0] = piece[sent:]
            else:
                self._waiting.popleft()

    def _drop(self) -> None:
        self._over = True
        self._waiting.clear()
        self._waiting_bytes = 0

    def _wait_for_room(self, size: int) -> None:
        while self._waiting and not self._stuck and self._waiting_bytes + size > MOST_BYTES:
            before = self._progress()
            self._wait_and_send()
            self._stuck = self._progress() == before

    def _wait_and_send(self) -> None:
        if not self._over:
            poll = select.poll()
            poll.register(self._socket, select.POLLOUT)
            poll.poll(1e3 * self._patience_s)
            self._send()

    def _give_up(self) -> None:
        logger.error("%s: the recording is cut off: the file takes nothing", self._path)
        self._given_up = self._process.hangs = True
        with self._lock:
            self._drop()
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)

    def _listen(self) -> None:
        """Hear what the process says, until the file is whole or nothing more comes of it."""
        last = self._last_sign()
        with self._lock:
            self._drop()
            self._socket.close()
        if last == WHOLE:
            self._whole = True
        elif not self._given_up:
            why = last.removeprefix(FAULT).decode() if last else self._process.why_it_ended()
            logger.error("%s: the recording ends here: %s", self._path, why)

    def _last_sign(self) -> bytes:
        """What the process says last; b"" if it ends without."""
        poll = select.poll()
        poll.register(self._socket, select.POLLIN)
        heard = b""
        while True:
            if poll.poll(1e3 * _LOOK_S):
                said = self._received()
                *signs, heard = (heard + said).split(b"\n")
                self._signs += len(signs)
                last = next((sign for sign in signs if sign != ALIVE), None)
                if last is not None or not said:
                    return last or b""
            if self._waiting:
                with self._lock:
                    self._send()

    def _received(self) -> bytes:
        """b"" at the end."""
        try:
            return self._socket.recv(LONGEST_SIGN)
        except OSError:
            return b""
