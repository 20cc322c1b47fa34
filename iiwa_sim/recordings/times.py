"""The times of a recording: simulated ones, by the robot's ticks, and real ones."""

from typing import Any

SECOND_NS = 1_000_000_000


class Times:
    """When things were, as messages and the file tell it."""

    def __init__(self, tick_rate_hz: int, began_ns: int, epoch_ns: int) -> None:
        """`began_ns` is when the recording began, `epoch_ns` the simulated time of tick 0; since 1970."""
        self.epoch_ns = epoch_ns
        self.began_ns = began_ns
        self._tick_rate_hz = tick_rate_hz

    def log_ns(self, tick: int) -> int:
        """The time of a tick in the file."""
        return self.epoch_ns + tick * SECOND_NS // self._tick_rate_hz

    def when(self, tick: int, real_ns: int) -> dict[str, Any]:
        """How messages tell when something was; `real_ns` is since 1970."""
        return {
            "time_s": round(tick / self._tick_rate_hz, 9),
            "tick": tick,
            "real_s": round((real_ns - self.began_ns) / SECOND_NS, 6),
        }
