"""What a benchmark finds, what is asked of it, and how it is shown: a table to read, JSON to keep."""

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from importlib.metadata import version
from typing import Any


class Kind(StrEnum):
    """What a value depends on, and so how well a goal can be held on a machine that does other work, too."""

    SIMULATED = "simulated"
    """Time of the robot and what is made of it: the same in every run."""
    CPU = "CPU time"
    """Thread or process time, or a rate per second of it. Other work slows it by way of shared caches."""
    RATIO = "ratio"
    """A value over a floor that is measured in turn with it, in the same run and on the same machine."""
    WALL = "wall time"
    """Whatever else the machine does counts, so the gate of CI leaves it out."""


MARGINS = {Kind.SIMULATED: 1.0, Kind.CPU: 1.5, Kind.RATIO: 1.3, Kind.WALL: 1.0}
"""By what factor a goal may be missed on a busy machine before the gate says so."""


@dataclass(frozen=True)
class Figure:
    """One number, and where there is one the floor: the same asked of a bare echo server in the same run.

    The goals are what the project asks of itself: of the value, or of value / floor. A figure with a goal
    says of which kind it is. Its margin for the gate is that of its kind, unless it says one of its own: a
    percentile of few samples needs more, and a goal that is known to be missed is held where it is today.
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

    def __post_init__(self) -> None:
        if self.goal and self.kind is None:
            raise ValueError(f"{self.name}: a figure with a goal says of which kind it is")

    @property
    def ratio(self) -> float | None:
        """Value / floor."""
        return None if self.floor is None else self.value / self.floor

    @property
    def goal(self) -> str:
        """The goal in words; empty without one."""
        if self.at_most is not None:
            return f"at most {self.at_most:g} {self.unit}".rstrip()
        if self.at_least is not None:
            return f"at least {self.at_least:g} {self.unit}".rstrip()
        return "" if self.ratio_at_most is None else f"at most {self.ratio_at_most:g} x floor"

    @property
    def met(self) -> bool | None:
        """Whether the goal is met; None without one."""
        return self._within(1.0)

    @property
    def gated(self) -> bool:
        """Whether a missed goal is a fault wherever it is measured."""
        return bool(self.goal) and self.kind is not Kind.WALL

    @property
    def held(self) -> bool:
        """Whether the gate lets it pass: there is no goal to hold, or it is met with the margin."""
        if not self.gated or self.kind is None:
            return True
        return self._within(MARGINS[self.kind] if self.margin is None else self.margin) is True

    def _within(self, margin: float) -> bool | None:
        if self.at_most is not None:
            return self.value <= margin * self.at_most
        if self.at_least is not None:
            return margin * self.value >= self.at_least
        if self.ratio_at_most is not None and self.ratio is not None:
            return self.ratio <= margin * self.ratio_at_most
        return None


def percentile(samples: Sequence[float], share: float) -> float:
    """The sample that `share` (0..1) of all are not above."""
    ordered = sorted(samples)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def table(figures: Sequence[Figure]) -> str:
    """One line per figure."""
    rows = [("", "value", "unit", "echo", "ratio", "goal", "kind", "met")]
    for figure in figures:
        floor = "" if figure.floor is None else _short(figure.floor)
        ratio = "" if figure.ratio is None else f"{figure.ratio:.2f}"
        met = {None: "", True: "yes", False: "NO"}[figure.met]
        kind = str(figure.kind or "") if figure.goal else ""
        rows.append((figure.name, _short(figure.value), figure.unit, floor, ratio, figure.goal, kind, met))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for name, value, unit, floor, ratio, goal, kind, met in rows:
        left = f"{name:<{widths[0]}}  {value:>{widths[1]}} {unit:<{widths[2]}}"
        right = f"{floor:>{widths[3]}}  {ratio:>{widths[4]}}  {goal:<{widths[5]}}  {kind:<{widths[6]}}  {met}"
        lines.append(f"{left}  {right}".rstrip())
    return "\n".join(lines)


def as_json(figures: Sequence[Figure]) -> str:
    """The figures and the machine they come from."""
    machine: dict[str, Any] = {
        "python": platform.python_version(),
        "system": platform.platform(),
        "cores": os.cpu_count(),
        "versions": {name: version(name) for name in ("iiwa-sim", "pin", "ruckig", "numpy", "msgspec")},
    }
    found = [{**asdict(f), "ratio": f.ratio, "met": f.met} for f in figures]
    return json.dumps({"machine": machine, "figures": found}, indent=1)


def _short(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
