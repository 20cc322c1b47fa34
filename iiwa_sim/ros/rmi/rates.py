"""When messages that recur are due, counted in ticks."""

from collections.abc import Mapping


class Rates:
    """Rates of several things (Hz of simulated time), each of which is due at most once a tick."""

    def __init__(self, rates_hz: Mapping[str, int], tick_rate_hz: int) -> None:
        """A thing with a rate of 0 is never due."""
        self._tick_rate_hz = tick_rate_hz
        self._rates_hz = {name: rate_hz for name, rate_hz in rates_hz.items() if rate_hz}
        self.names = tuple(self._rates_hz)
        """The things that recur."""
        self._parts = dict.fromkeys(self._rates_hz, 0)  # of a message, in units of 1 / tick_rate_hz

    def due(self) -> list[str]:
        """Notice that a tick has been made; gives what is due now."""
        told = []
        for name, rate_hz in self._rates_hz.items():
            part = self._parts[name] + rate_hz
            if part >= self._tick_rate_hz:
                part = min(part - self._tick_rate_hz, self._tick_rate_hz)
                told.append(name)
            self._parts[name] = part
        return told

    def skip(self, ticks: int) -> None:
        """Count ticks in which nothing is published."""
        for name, rate_hz in self._rates_hz.items():
            self._parts[name] = (self._parts[name] + ticks * rate_hz) % self._tick_rate_hz
