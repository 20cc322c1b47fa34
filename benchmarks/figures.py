"""What a benchmark finds, and how it is shown: a table to read, JSON to keep."""

import json
import os
import platform
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any, NamedTuple


class Figure(NamedTuple):
    """One number, and where there is one the floor: the same asked of a bare echo server in the same run.

    The goals are what the project asks of itself: of the value, or of value / floor.
    """

    name: str
    value: float
    unit: str
    floor: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    ratio_at_most: float | None = None

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
        if self.at_most is not None:
            return self.value <= self.at_most
        if self.at_least is not None:
            return self.value >= self.at_least
        if self.ratio_at_most is not None and self.ratio is not None:
            return self.ratio <= self.ratio_at_most
        return None


def percentile(samples: Sequence[float], share: float) -> float:
    """The sample that `share` (0..1) of all are not above."""
    ordered = sorted(samples)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def table(figures: Sequence[Figure]) -> str:
    """One line per figure."""
    rows = [("", "value", "unit", "echo", "ratio", "goal", "met")]
    for figure in figures:
        floor = "" if figure.floor is None else _short(figure.floor)
        ratio = "" if figure.ratio is None else f"{figure.ratio:.2f}"
        met = {None: "", True: "yes", False: "NO"}[figure.met]
        rows.append((figure.name, _short(figure.value), figure.unit, floor, ratio, figure.goal, met))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for name, value, unit, floor, ratio, goal, met in rows:
        left = f"{name:<{widths[0]}}  {value:>{widths[1]}} {unit:<{widths[2]}}"
        lines.append(
            f"{left}  {floor:>{widths[3]}}  {ratio:>{widths[4]}}  {goal:<{widths[5]}}  {met}".rstrip()
        )
    return "\n".join(lines)


def as_json(figures: Sequence[Figure]) -> str:
    """The figures and the machine they come from."""
    machine: dict[str, Any] = {
        "python": platform.python_version(),
        "system": platform.platform(),
        "cores": os.cpu_count(),
        "versions": {name: version(name) for name in ("iiwa-sim", "pin", "ruckig", "numpy", "msgspec")},
    }
    found = [{**f._asdict(), "ratio": f.ratio, "met": f.met} for f in figures]
    return json.dumps({"machine": machine, "figures": found}, indent=1)


def _short(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
