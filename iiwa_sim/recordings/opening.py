"""The file of a recording, opened: what is wrong with it is told at once."""

import os
from contextlib import suppress
from io import FileIO
from pathlib import Path

from iiwa_sim.recordings.fault import RecordingFault

MAGIC = b"\x89MCAP0\r\n"
"""What an MCAP file begins and ends with: https://mcap.dev/spec#magic"""


def opened(path: Path) -> FileIO:
    """A file with the first bytes of a recording in it, and nothing else; one that was there is overwritten.

    Raises RecordingFault where it cannot be written.
    """
    try:
        there = path.exists()
        if there and (not (path.is_file() or path.is_char_device()) or _is_where_is_spoken(path)):
            raise _no_file(path)
        stream = path.open("wb", buffering=0)
    except (OSError, ValueError) as fault:  # ValueError for a name with a NUL
        raise _unwritable(path, fault) from None
    try:
        if stream.isatty() or not stream.seekable():
            raise _no_file(path)
        stream.write(MAGIC)
    except (OSError, RecordingFault) as fault:
        with suppress(OSError):
            stream.close()
        if not there:  # nothing found room in it
            with suppress(OSError):
                path.unlink()
        if isinstance(fault, RecordingFault):
            raise
        raise _unwritable(path, fault) from None
    return stream


def _is_where_is_spoken(path: Path) -> bool:
    """Whether standard output or standard error go to this file: words and recording would overwrite each
    other."""
    for descriptor in (1, 2):
        with suppress(OSError):  # it is closed
            if path.is_file() and os.path.samestat(os.fstat(descriptor), path.stat()):
                return True
    return False


def _no_file(path: Path) -> RecordingFault:
    return RecordingFault(f"{path}: expected the name of a file, to write a recording there")


def _unwritable(path: Path, fault: Exception) -> RecordingFault:
    return RecordingFault(f"{path}: cannot be written: {getattr(fault, 'strerror', None) or fault}")
