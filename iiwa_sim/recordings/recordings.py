"""The recordings of one simulator, and the reason that one cannot be written, read or used."""

import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Self

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.robot_events import RobotEvents
from iiwa_sim.wording import Unusable, harmless, shortened

if TYPE_CHECKING:
    from iiwa_sim.recordings.recorder import Recorder

LONGEST_MESSAGE = 400
"""Characters of a message, which may cite paths."""


class RecordingFault(Unusable):
    """The message is one line that names the file and the reason."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


def check_mcap() -> None:
    """Raise RecordingFault if the extra is not installed."""
    if importlib.util.find_spec("mcap") is None:
        raise RecordingFault("a recording needs the library mcap: pip install -e '.[record]'")


class Source(NamedTuple):
    """A robot as recordings see it."""

    cell: Cell
    controller: Controller
    dialogue: Dialogue
    wire: WireFaults
    backdoor: Backdoor
    log: SessionLog
    events: RobotEvents
    protocols: Sequence[str]


class Recording:
    """A recording that has begun."""

    def __init__(self, close: Callable[[], None]) -> None:
        self.close = close
        """End it; the file is whole then. Does nothing a second time."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Recordings:
    """Any number of recordings at a time, each begun and ended between two ticks."""

    def __init__(self, clock: Clock, on_change: Callable[[], None]) -> None:
        """`on_change` is called when there is a recorder more or less in `recorders`."""
        self.recorders: list[Recorder] = []
        self._clock = clock
        self._on_change = on_change

    def begin(
        self,
        path: Path,
        rate_hz: int | None,
        sources: Sequence[Source],
        call: Callable[[Callable[[], None]], None] = lambda function: function(),
    ) -> Recording:
        """Record robots into a file; `call` runs a function in their thread, between two ticks.

        Raises RecordingFault where the file cannot be written or the library mcap is not installed, and
        ValueError for a rate outside 1 to that of the ticks.
        """
        check_mcap()
        from iiwa_sim.recordings.recorder import recorders_into

        recorders = recorders_into(path, sources, self._clock, rate_hz)

        def start() -> None:
            self.recorders += recorders
            self._on_change()
            self._clock.look()  # ticks go on from here, each of them seen
            for recorder in recorders:
                recorder.start()

        def close() -> None:
            call(lambda: self._stop(recorders))
            recorders[0].out.close()

        call(start)
        return Recording(close)

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
