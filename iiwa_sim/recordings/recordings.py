"""The recordings of one simulator: which there are, and what each is told of."""

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
from iiwa_sim.recordings.fault import needs_mcap
from iiwa_sim.robot_events import RobotEvents

if TYPE_CHECKING:
    from iiwa_sim.recordings.recorder import Recorder


class Recording:
    """A recording that has begun."""

    def __init__(self, close: Callable[[], None]) -> None:
        self.close = close
        """End it; the file is whole then. Does nothing a second time."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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


class Recordings:
    """Any number of recordings at a time, each begun and ended between two ticks."""

    def __init__(self, clock: Clock, on_change: Callable[[], None]) -> None:
        """`on_change` is called when there is a recorder more or less in `recorders`."""
        self.recorders: list[Recorder] = []
        self._clock = clock
        self._on_change = on_change

    def new(self, path: Path, rate_hz: int | None, sources: Sequence[Source]) -> "list[Recorder]":
        """Recorders into a file that have not begun; it reads and writes files, so in any thread.

        Raises RecordingFault where the file cannot be written or the library mcap is not installed, and
        ValueError for a rate outside 1 to that of the ticks.
        """
        with needs_mcap():
            from iiwa_sim.recordings.recorder import Recorder
        several = len(sources) > 1
        first, *others = recorders = [
            Recorder(each, self._clock, rate_hz, each.cell.name if several else "", each is sources[0])
            for each in sources
        ]
        first.open(path, others)
        return recorders

    def start(self, recorders: "Sequence[Recorder]") -> None:
        """Have recorders see all from here on."""
        self.recorders += recorders
        self._on_change()
        self._clock.look()  # ticks go on from here, each of them seen
        for recorder in recorders:
            recorder.start()

    def stop(self, recorders: "Sequence[Recorder]") -> None:
        """Have recorders see nothing more; does nothing for those that have been stopped."""
        for recorder in recorders:
            if recorder in self.recorders:
                recorder.stop()
                self.recorders.remove(recorder)
        self._on_change()

    def recording(
        self,
        path: Path,
        rate_hz: int | None,
        sources: Sequence[Source],
        call: Callable[[Callable[[], None]], None],
    ) -> Recording:
        """Make recorders, here, and start them by `call`, in the robots' thread. Raises as `new` does."""
        recorders = self.new(path, rate_hz, sources)
        call(lambda: self.start(recorders))

        def close() -> None:
            call(lambda: self.stop(recorders))
            recorders[0].finish()

        return Recording(close)

    def end_all(self) -> None:
        """End those that have not been ended."""
        recorders = list(self.recorders)
        self.stop(recorders)
        for recorder in {each.out: each for each in recorders}.values():
            recorder.finish()
