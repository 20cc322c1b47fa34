"""The error of a picture."""

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message, which may quote paths and commands."""


class PlotFault(Unusable):
    """A picture cannot be made. The message is one line that names the file and what is wrong."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))
