"""Recordings of a robot in MCAP: written while it runs, read, drawn and played: docs/recordings.md."""

from iiwa_sim.wording import Unusable, harmless, shortened


class RecordingFault(Unusable):
    """The message is one line that names the file and the reason."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), 400))
