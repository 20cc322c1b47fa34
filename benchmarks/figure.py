"""A measured value and its goal."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """A measured value, with that of a bare echo server in the same run if there is one.

    Goals apply to the value, or to its ratio to that of the echo server. `margin` is the factor by which the
    gate lets a goal be missed. Without one the goal is only reported.
    """

    name: str
    value: float
    unit: str
    echo: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    margin: float | None = None

    @property
    def compared(self) -> float:
        """The number that the goal is about."""
        return self.value if self.echo is None else self.value / self.echo

    @property
    def goal(self) -> str:
        """The goal in words; empty without one."""
        unit = self.unit if self.echo is None else "x echo"
        if self.at_most is not None:
            return f"at most {self.at_most:g} {unit}"
        return "" if self.at_least is None else f"at least {self.at_least:g} {unit}"

    def meets(self, margin: float = 1.0) -> bool:
        """Return True if the goal is met, or missed by at most this factor; also without a goal."""
        if self.at_most is not None:
            return self.compared <= margin * self.at_most
        return self.at_least is None or margin * self.compared >= self.at_least


def percentile(samples: Sequence[float], share: float) -> float:
    """Return the sample below which a share (0..1) of all samples lies."""
    ordered = sorted(samples)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]
