"""A recording written into its file, of what comes over a socket: in the process that does nothing else."""

import socket
import struct
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from iiwa_sim.recordings.contents import Contents
from iiwa_sim.recordings.handed import Beginning, Closed, Frames, Lost, beginning_in, handed_in
from iiwa_sim.recordings.mcap_file import Head, McapFile
from iiwa_sim.recordings.scene import Arm
from iiwa_sim.recordings.signs import ALIVE, FAULT, LONGEST_SIGN, WHOLE
from iiwa_sim.recordings.times import Times
from iiwa_sim.recordings.views import Views
from iiwa_sim.robot.model import arm_model
from iiwa_sim.wording import harmless, shortened

PERIOD_S = 0.4
"""Time between two looks at what has come: much at a time costs a third of what little by little would."""
FLUSH_S = 0.3
"""A chunk is ended no sooner than so long after the one before, however much comes."""
_AT_ONCE_BYTES = 128 * 1024
"""So much is not waited for any longer: some 250 states."""
GONE = {"cause": "the process of the robot has ended, and the recording with it"}
"""What the end of such a file says beside the number of lost messages."""


def write(connection: socket.socket, stream: BinaryIO, alone: Callable[[], bool]) -> None:
    """Write a file to its end, and tell who sends how it goes.

    The end is what is told to be it, or that nothing more comes: the connection has ended, or nobody is there
    who could send (`alone`), though a process forked off it may still hold the connection.
    """
    with connection:
        try:
            _say(connection, ALIVE)
            file: _File | None = None
            for frames in _frames(connection, alone):
                if file is None and frames:
                    file = _File(stream, beginning_in(frames.pop(0)))
                if file is not None:
                    file.add(frames)
                _say(connection, ALIVE)
            if file is not None:
                file.finish()
            _say(connection, WHOLE)
        except OSError as fault:
            _say(connection, FAULT, fault.strerror or f"{fault}")
        except Exception as fault:  # noqa: BLE001  # ours, which must not leave who sends without an answer
            _say(connection, FAULT, _told(fault))
        finally:
            with suppress(OSError):  # what is in its buffer finds no room either; the descriptor is closed
                stream.close()


class _File:
    """A recording that has begun."""

    def __init__(self, stream: BinaryIO, beginning: Beginning) -> None:
        description = beginning.description
        times = Times(beginning.tick_rate_hz, beginning.began_ns, beginning.epoch_ns)
        self._contents = Contents(
            Views(Arm(arm_model(description).links), description.joints),
            times,
        )
        self._file = McapFile(stream, Head(beginning.metadata, beginning.attachments, beginning.began_ns))
        self._number = 0
        self._end = {"lost_messages": "0", **GONE}
        self._flushed_s = time.monotonic()
        self._dirty = False

    def add(self, frames: list[bytes]) -> None:
        """Write what was handed over, and hand it to the system if that was not done a moment ago."""
        for frame in frames:
            handed = handed_in(frame)
            for message in self._contents.made(handed):
                self._number += 1
                self._file.add(message.topic, message.data, message.log_ns, message.publish_ns, self._number)
            self._dirty = True
            for each in handed:
                if isinstance(each, Lost):
                    self._end["lost_messages"] = f"{each.messages}"
                elif isinstance(each, Closed):
                    self._end.pop("cause", None)
        if self._dirty and time.monotonic() - self._flushed_s > FLUSH_S:
            self._file.flush()
            self._flushed_s, self._dirty = time.monotonic(), False

    def finish(self) -> None:
        """Write the end."""
        self._file.finish(self._end)


def _frames(connection: socket.socket, alone: Callable[[], bool]) -> Iterator[list[bytes]]:
    """What has come, once in PERIOD_S, or when it is much; nothing where nothing has."""
    seconds, part = divmod(PERIOD_S, 1.0)
    connection.setsockopt(
        socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("@ll", int(seconds), round(1e6 * part))
    )
    frames = Frames()
    while True:
        try:
            data = connection.recv(_AT_ONCE_BYTES, socket.MSG_WAITALL)
        except BlockingIOError:
            if alone():
                return
            yield []
            continue
        except ConnectionResetError:  # who has sent has gone without having heard all
            return
        if not data:
            return
        yield frames.taken(data)


def _say(connection: socket.socket, sign: bytes, more: str = "") -> None:
    """Tell who sends; nobody may be there."""
    with suppress(OSError):
        connection.send(sign + shortened(harmless(more), LONGEST_SIGN // 8).encode() + b"\n")


def _told(fault: Exception) -> str:
    """What went wrong, and where, in a line."""
    *_, frame = traceback.extract_tb(fault.__traceback__)
    return f"internal error: {fault!r} in {Path(frame.filename).name}, line {frame.lineno}"
