"""Why a transcript cannot be read, written or played."""

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Characters of a message, which may cite paths and lines."""


class TranscriptFault(Unusable):
    """The message is one line that names the file or the server and what is wrong."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


class NoServer(TranscriptFault):
    """Nobody can be connected to."""
