"""The time of a stepped simulator, which passes when it is waited for."""

from __future__ import annotations

from iiwa_sim.simulator import Simulator


class SimulatedTime:
    """What `replay` takes for the robot's time."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator

    def now_s(self) -> float:
        simulator = self._simulator
        return simulator.call(lambda: simulator.controller.tick * simulator.controller.tick_s)

    def wait(self, seconds: float) -> None:
        self._simulator.advance(seconds)
