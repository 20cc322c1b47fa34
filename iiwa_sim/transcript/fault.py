"""The errors of transcripts."""

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message, which may quote paths and lines."""


class TranscriptFault(Unusable):
    """A transcript cannot be read, written or played. The message is one line that names the file or the
    server."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


class NoServer(TranscriptFault):
    """No connection to the server."""
