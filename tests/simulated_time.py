"""The time of a stepped simulator, which passes when it is waited for."""

from __future__ import annotations

from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.replay import Time


def simulated_time(simulator: Simulator) -> Time:
    """Return what `replay` takes for the robot's time."""
    return Time(lambda: simulator.state().time_s, simulator.advance)
