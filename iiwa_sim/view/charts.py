"""Charts of the last 20 s of simulated time: joint velocities, force, speed of the TCP."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from math import dist, hypot
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from viser import uplot

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.scene import State

SECONDS = 20.0
EVERY_S = 0.2
"""Simulated time between two samples (s)."""
SENT_EVERY_S = 0.5
"""Real time between two updates of a chart (s)."""
SAMPLES = round(SECONDS / EVERY_S) + 1
_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2")


class Samples:
    """Values at even times, the newest ones."""

    def __init__(self, count: int) -> None:
        """`count` is the number of values in a sample."""
        self._rows: deque[tuple[float, ...]] = deque([(0.0,) * count] * SAMPLES, maxlen=SAMPLES)
        self._number = 0  # of the newest sample, in EVERY_S from the start of simulated time

    def add(self, time_s: float, values: Sequence[float]) -> None:
        """Add the values that hold from this time on. Time that goes back begins anew."""
        number = int(time_s / EVERY_S)
        if number < self._number or number - self._number >= SAMPLES:
            empty = (0.0,) * len(values)
            self._rows.extend([empty] * SAMPLES)
            self._number = number
        while self._number < number:
            self._rows.append(tuple(values))
            self._number += 1

    def columns(self) -> NDArray[np.float64]:
        """Values (count, SAMPLES), oldest first."""
        return np.array(self._rows).T


class Charts:
    """Three charts of one robot, in the panel. What does not change is not sent."""

    def __init__(self, gui: viser.GuiApi, joints: Sequence[str], velocity: Sequence[float]) -> None:
        """`velocity` are the limits of the joints (rad/s)."""

        self._limits = tuple(velocity)
        self._samples = Samples(len(joints) + 2)
        self._sent: NDArray[np.float64] | None = None
        self._next_s = 0.0
        self._tcp: tuple[float, Sequence[float], float] | None = None  # time, place (mm), speed
        self._ago = np.linspace(-SECONDS, 0.0, SAMPLES)

        def chart(title: str, names: Sequence[str]) -> Any:
            series = [uplot.Series(label="s")]
            series += [
                uplot.Series(label=name, stroke=colour, width=1.5)
                for name, colour in zip(names, _COLOURS, strict=False)
            ]
            gui.add_markdown(title)
            nothing = np.zeros(SAMPLES)
            return gui.add_uplot(
                data=(self._ago, *[nothing] * len(names)),
                series=tuple(series),
                scales={"x": uplot.Scale(time=False)},
                aspect=2.2,
            )

        self._joints: Any = chart("Joint velocities (% of their limits)", joints)
        self._force: Any = chart("Force at the TCP (N)", ["force"])
        self._speed: Any = chart("Speed of the TCP (mm/s)", ["speed"])

    def add(self, state: State) -> None:
        """A state, in the order of time."""
        share = [100.0 * v / most for v, most in zip(state["joint_velocity"], self._limits, strict=True)]
        self._samples.add(
            state["time_s"], [*share, hypot(*state["cartesian_force"][:3]), self._tcp_speed(state)]
        )

    def show(self) -> None:
        """Send what has changed."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + SENT_EVERY_S
        columns = np.round(self._samples.columns(), 2)
        before, self._sent = self._sent, columns
        count = len(self._limits)
        for chart, rows in (
            (self._joints, slice(0, count)),
            (self._force, slice(count, count + 1)),
            (self._speed, slice(count + 1, count + 2)),
        ):
            if before is None or not np.array_equal(before[rows], columns[rows]):
                chart.data = (self._ago, *columns[rows])

    def _tcp_speed(self, state: State) -> float:
        time_s, place = state["time_s"], state["tool_frame"][:3]
        if self._tcp is None or time_s < self._tcp[0]:
            self._tcp = (time_s, place, 0.0)
        elif time_s > self._tcp[0]:
            self._tcp = (time_s, place, dist(place, self._tcp[1]) / (time_s - self._tcp[0]))
        return self._tcp[2]
