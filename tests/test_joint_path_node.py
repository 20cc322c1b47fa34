"""Streams of joint targets as Fraunhofer IPA's joint path node sends them: speed 0 for a joint that stays."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi

import pytest

from iiwa_sim.robot.description import load_robot
from iiwa_sim.simulator import Simulator
from tests.line_client import Client

IIWA = load_robot("lbr_iiwa_7_r800")
PERIOD_S = 0.02
NEXT_RAD = 0.02
"""The node sends its next target when no joint is farther than that from the one before."""

Joints = Sequence[float]


def path(ends: dict[int, float], seconds: float) -> list[list[float]]:
    """Targets 50 times a second, by which some joints go that far (rad) from home, and the others stay."""
    count = round(seconds / PERIOD_S)
    parts = [0.5 - 0.5 * cos(pi * k / count) for k in range(1, count + 1)]
    return [[q + part * ends.get(joint, 0.0) for joint, q in enumerate(IIWA.home)] for part in parts]


def speeds(present: Joints, target: Joints, left_s: float) -> list[float]:
    """Relative speeds by which each joint is there in the time that is left; full ones where none is."""
    if left_s <= 0.0:
        return [1.0] * len(target)
    rates = [abs(b - a) / left_s for a, b in zip(present, target, strict=True)]
    return [min(rate / limit, 1.0) for rate, limit in zip(rates, IIWA.velocity, strict=True)]


PATH = path({0: 0.25, 5: -0.2}, 0.5)


@pytest.mark.requirement("FRA104", "FRC004")
async def test_the_node_moves_the_robot_through_the_socket() -> None:
    """It gives targets one by one, with the speeds by which each joint is there in time."""
    due = [(PERIOD_S * k, target) for k, target in enumerate(PATH, start=1)]
    target: Joints | None = None
    async with Simulator(clock="stepped") as simulator:
        driver = await Client.connect(simulator.port)
        for k in range(500):
            present = list(map(float, (await driver.ask("get joint position")).split()))
            if target is None or max(abs(b - a) for a, b in zip(present, target, strict=True)) < NEXT_RAD:
                due_s, target = due.pop(0)
                at = speeds(present, target, due_s - k * PERIOD_S)
                assert await driver.ask(f"direct joint move : {' '.join(map(str, [*target, *at]))}") == "done"
            await simulator.clock.advance(PERIOD_S)
            if not due:
                break
        await simulator.clock.run_until_stopped(10.0)
        assert simulator.controller.joints == tuple(PATH[-1])
        await driver.leaves()
