"""The figures of benchmarks: values, goals, and their output as a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """The kind of a value, which decides how strictly a goal can be checked on a busy machine."""

    SIMULATED = "simulated"
    """Simulated time and derived values: the same in every run."""
    CPU = "CPU time"
    """CPU time of a thread or process, or a rate per second of it. Other load slows it through shared
    caches."""
    RATIO = "ratio"
    """A ratio to a reference that is measured alternately, in the same run and on the same machine."""
    TAIL = "ratio of p99"
    """A ratio of percentiles near the largest sample. Who gets a processor decides it, even beside a
    reference of the same run, so CI does not check it."""
    WALL = "wall time"
    """Wall time depends on all other load, so CI does not check it."""


NOT_HELD = (Kind.TAIL, Kind.WALL)
MARGINS = {Kind.SIMULATED: 1.0, Kind.CPU: 2.0, Kind.RATIO: 2.0}
"""Factors by which the gate lets a goal be missed, for other load of the machine."""


@dataclass(frozen=True)
class Figure:
    """One value, and possibly the reference: the same measurement of a bare echo server in the same run.

    Goals apply to the value, or to value / reference. A figure with a goal has a kind. Its margin in the gate
    is that of its kind, unless it has its own.
    """

    name: str
    value: float
    unit: str
    floor: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    ratio_at_most: float | None = None
    kind: Kind | None = None
    margin: float | None = None

    @property
    def ratio(self) -> float | None:
        """Value / reference."""
        return None if self.floor is None else self.value / self.floor

    @property
    def goal(self) -> str:
        """The goal in words; empty without one."""
        if self.at_most is not None:
            return f"at most {self.at_most:g} {self.unit}".rstrip()
        if self.at_least is not None:
            return f"at least {self.at_least:g} {self.unit}".rstrip()
        return "" if self.ratio_at_most is None else f"at most {self.ratio_at_most:g} x floor"

    def met(self, margin: float = 1.0) -> bool:
        """Return True if the goal is met, or missed by at most this factor; also without a goal."""
        if self.at_most is not None:
            return self.value <= margin * self.at_most
        if self.at_least is not None:
            return margin * self.value >= self.at_least
        if self.ratio_at_most is not None and self.ratio is not None:
            return self.ratio <= margin * self.ratio_at_most
        return True

    def held(self, gate: bool) -> bool:
        """Return True if the figure does not fail the run: wall time and p99 never do."""
        if self.kind is None or self.kind in NOT_HELD:
            return True
        return self.met((self.margin or MARGINS[self.kind]) if gate else 1.0)


def percentile(samples: Sequence[float], share: float) -> float:
    """Return the sample below which a share (0..1) of all samples lies."""
    ordered = sorted(samples)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def table(figures: Sequence[Figure]) -> str:
    """Return one line per figure."""
    rows = [("", "value", "unit", "echo", "ratio", "goal", "kind", "met")]
    for figure in figures:
        floor = "" if figure.floor is None else _short(figure.floor)
        ratio = "" if figure.ratio is None else f"{figure.ratio:.2f}"
        met = "" if not figure.goal else "yes" if figure.met() else "NO"
        kind = str(figure.kind or "") if figure.goal else ""
        rows.append((figure.name, _short(figure.value), figure.unit, floor, ratio, figure.goal, kind, met))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for name, value, unit, floor, ratio, goal, kind, met in rows:
        left = f"{name:<{widths[0]}}  {value:>{widths[1]}} {unit:<{widths[2]}}"
        right = f"{floor:>{widths[3]}}  {ratio:>{widths[4]}}  {goal:<{widths[5]}}  {kind:<{widths[6]}}  {met}"
        lines.append(f"{left}  {right}".rstrip())
    return "\n".join(lines)


def _short(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
