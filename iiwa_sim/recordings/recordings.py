"""The recordings of one simulator: which there are, and what each is told of."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

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


class Recordings:
    """Any number of recordings at a time, each begun and ended between two ticks."""

    def __init__(
        self,
        controller: Controller,
        cell: Cell,
        clock: Clock,
        dialogue: Dialogue,
        wire: WireFaults,
        backdoor: Backdoor,
        log: SessionLog,
        events: RobotEvents,
        protocols: Sequence[str],
        on_change: Callable[[], None],
    ) -> None:
        """`on_change` is called when there is a recorder more or less in `recorders`."""
        self.recorders: list[Recorder] = []
        self._controller = controller
        self._cell = cell
        self._clock = clock
        self._dialogue = dialogue
        self._wire = wire
        self._backdoor = backdoor
        self._log = log
        self._events = events
        self._protocols = protocols
        self._on_change = on_change

    def new(self, path: Path, rate_hz: int | None) -> "Recorder":
        """A recorder into a file that has not begun; it reads and writes files, so in any thread.

        Raises RecordingFault where the file cannot be written or the library mcap is not installed, and
        ValueError for a rate outside 1 to that of the ticks.
        """
        with needs_mcap():
            from iiwa_sim.recordings import recorder
        return recorder.Recorder(
            path,
            self._controller,
            self._dialogue,
            cell=self._cell,
            tick_rate_hz=self._clock.rate_hz,
            rate_hz=rate_hz,
            clock=lambda: self._clock.told,
            in_haste=lambda: self._clock.in_haste or self._clock.paused,
            said_of_it={"protocols": " ".join(self._protocols)},
        )

    def start(self, recorder: "Recorder") -> None:
        """Have a recorder see all from here on."""
        self.recorders.append(recorder)
        self._log.on_refused.append(recorder.refused)
        self._events.listeners.append(recorder)
        self._backdoor.listeners.append(recorder.backdoor)
        self._on_change()
        self._clock.look()  # ticks go on from here, each of them seen
        recorder.start([(name, protocol or self._protocols[0]) for name, protocol in self._wire.peers()])

    def stop(self, recorder: "Recorder") -> None:
        """Have a recorder see nothing more; does nothing for one that has been stopped."""
        if recorder in self.recorders:
            recorder.stop()
            self.recorders.remove(recorder)
            self._log.on_refused.remove(recorder.refused)
            self._events.listeners.remove(recorder)
            self._backdoor.listeners.remove(recorder.backdoor)
            self._on_change()

    def recording(
        self, path: Path, rate_hz: int | None, call: Callable[[Callable[[], None]], None]
    ) -> Recording:
        """Make a recorder, here, and start it by `call`, in the robot's thread. Raises as `new` does."""
        recorder = self.new(path, rate_hz)
        call(lambda: self.start(recorder))

        def close() -> None:
            call(lambda: self.stop(recorder))
            recorder.finish()

        return Recording(close)

    def begin(self, path: Path, rate_hz: int | None) -> "Recorder":
        """Make a recorder and start it. Raises as `new` does."""
        recorder = self.new(path, rate_hz)
        self.start(recorder)
        return recorder

    def end(self, recorder: "Recorder") -> None:
        """Stop a recorder, and make its file whole."""
        self.stop(recorder)
        recorder.finish()

    def end_all(self) -> None:
        """End those that have not been ended."""
        for recorder in list(self.recorders):
            self.end(recorder)
