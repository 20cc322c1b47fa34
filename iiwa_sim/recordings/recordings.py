"""The recordings of one simulator, and the reason that one cannot be written, read or used."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.robot_events import RobotEvents
from iiwa_sim.wording import Unusable, harmless, need_library, shortened

if TYPE_CHECKING:
    from iiwa_sim.recordings.recorder import Recorder

LONGEST_MESSAGE = 400
"""Characters of a message, which may cite paths."""


class RecordingFault(Unusable):
    """The message is one line that names the file and the reason."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


class Source(NamedTuple):
    """A robot as recordings see it."""

    cell: Cell
    controller: Controller
    dialogue: Dialogue
    backdoor: Backdoor
    log: SessionLog
    events: RobotEvents


class Recordings:
    """Any number of recordings at a time, each begun and ended between two ticks."""

    def __init__(self, clock: Clock, on_change: Callable[[], None]) -> None:
        """`on_change` is called when there is a recorder more or less in `recorders`."""
        self.recorders: list[Recorder] = []
        self._clock, self._on_change = clock, on_change

    def begin(
        self,
        path: Path,
        rate_hz: int | None,
        sources: Sequence[Source],
        call: Callable[[Callable[[], None]], None] = lambda function: function(),
    ) -> ExitStack:
        """Record robots into a file until the context that is returned ends.

        `call` runs a function in the robots' thread, between two ticks. Raises RecordingFault where the file
        cannot be written or the library mcap is not installed, and ValueError for a rate outside 1 to that of
        the ticks.
        """
        need_library("mcap", "record")
        from iiwa_sim.recordings.recorder import recorders_into

        most_hz = self._clock.rate_hz
        if rate_hz is not None and not 1 <= rate_hz <= most_hz:
            raise ValueError(f"record_rate_hz is {rate_hz}, expected 1 to {most_hz}, that of the ticks")
        recorders = recorders_into(path, sources, self._clock, rate_hz or most_hz)

        def start() -> None:
            self.recorders += recorders
            self._on_change()  # the robots do not rest from here on
            for recorder in recorders:
                recorder.start()

        call(start)
        recording = ExitStack()
        recording.callback(recorders[0].out.close)
        recording.callback(call, lambda: self._stop(recorders))  # which comes first
        return recording

    def end_all(self) -> None:
        """End those that have not been ended."""
        recorders = list(self.recorders)
        self._stop(recorders)
        for out in {each.out for each in recorders}:
            out.close()

    def _stop(self, recorders: "Sequence[Recorder]") -> None:
        """Have recorders see nothing more; does nothing for those that have been stopped."""
        for recorder in recorders:
            if recorder in self.recorders:
                recorder.stop()
                self.recorders.remove(recorder)
        self._on_change()
