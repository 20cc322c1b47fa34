"""Why a recording cannot be written, read or used."""

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Characters of a message, which may cite paths."""

_LIBRARIES = ("mcap", "zstandard", "lz4")
EXTRA = "a recording needs the library mcap: pip install -e '.[record]'"


class RecordingFault(Unusable):
    """The message is one line that names the file and what is wrong."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


@contextmanager
def needs_mcap() -> Iterator[None]:
    """A context to import what needs the extra; raises RecordingFault where that is not installed."""
    try:
        yield
    except ModuleNotFoundError as fault:
        if (fault.name or "").partition(".")[0] not in _LIBRARIES:
            raise
        raise RecordingFault(EXTRA) from None


def check_library() -> None:
    """Raises RecordingFault where what another process will need to write recordings is not installed."""
    if any(importlib.util.find_spec(library) is None for library in _LIBRARIES):
        raise RecordingFault(EXTRA)
