"""The reason that a recording cannot be written, read or used."""

from collections.abc import Iterator
from contextlib import contextmanager

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Characters of a message, which may cite paths."""
_LIBRARIES = ("mcap", "zstandard", "lz4")


class RecordingFault(Unusable):
    """The message is one line that names the file and the reason."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


@contextmanager
def needs_mcap() -> Iterator[None]:
    """A context to import modules that need the extra; raises RecordingFault if it is not installed."""
    try:
        yield
    except ModuleNotFoundError as fault:
        if (fault.name or "").partition(".")[0] not in _LIBRARIES:
            raise
        raise RecordingFault("a recording needs the library mcap: pip install -e '.[record]'") from None
