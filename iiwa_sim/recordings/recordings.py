"""The recordings of one simulator, and the reason that one cannot be written, read or used."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.robot_events import RobotEvents
from iiwa_sim.wording import Unusable, harmless, need_library, shortened

if TYPE_CHECKING:
    from iiwa_sim.recordings.recorder import Recorder


class RecordingFault(Unusable):
    """The message is one line that names the file and the reason."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), 400))


class Source(NamedTuple):
    """A robot as recordings see it."""

    cell: Cell
    controller: Controller
    dialogue: Dialogue
    log: SessionLog
    events: RobotEvents


class Recordings:
    """Any number of recordings at a time, each begun and ended between two ticks."""

    def __init__(self, clock: Clock, on_change: Callable[[], None]) -> None:
        """`on_change` is called when there is a recorder more or less in `recorders`."""
        self.recorders: list[Recorder] = []
        self._clock, self._on_change = clock, on_change
        self._begun: list[ExitStack] = []

    def begin(
        self,
        path: Path,
        rate_hz: int | None,
        sources: Sequence[Source],
        call: Callable[[Callable[[], None]], None] = lambda function: function(),
    ) -> ExitStack:
        """Record robots into a file until the context that is returned ends.

        `call` runs a function in the robots' thread, between two ticks. Raises RecordingFault where the file
        cannot be written, and ValueError for a rate outside 1 to that of the ticks.
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
            for each in recorders:
                each.start()

        def stop() -> None:
            for each in recorders:
                each.stop()
                self.recorders.remove(each)
            self._on_change()

        call(start)
        recording = ExitStack()
        recording.callback(recorders[0].out.close)
        recording.callback(call, stop)  # which comes first
        self._begun.append(recording)
        return recording

    def end_all(self) -> None:
        """End those that have not been ended."""
        for each in self._begun:
            each.close()
