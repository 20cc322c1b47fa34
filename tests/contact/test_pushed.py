"""The balance of a part that is pushed, against closed forms, and compiled against its text."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.contact.pushed_kernel import Balance
from iiwa_sim.contact.pushers import Below, Pressing
from tests.interpreted import interpreted

TICK_S = 0.002
POINTS = ((0.01, 0.01), (-0.01, 0.01), (-0.01, -0.01), (0.01, -0.01))
REST = (0.0, 0.0, 0.0, 0.0)


def below(mass: float = 0.2, friction: float = 0.5, stiffness: float = 2e4) -> Below:
    return Below(stiffness, mass * 9.81 / stiffness, mass * 9.81, 0.0, friction, POINTS, (0.0,) * 8)


def test_with_nothing_that_presses_it_stays_or_is_braked_by_friction() -> None:
    balance = Balance()
    assert balance.way(0.2, 1e-4, REST, below(), (), TICK_S)[0] == pytest.approx(REST, abs=1e-12)
    way, _ = balance.way(0.2, 1e-4, (0.5, 0.0, 0.0, 0.0), below(), (), TICK_S)
    assert way == pytest.approx((TICK_S * (0.5 - 0.5 * 9.81 * TICK_S), 0.0, 0.0, 0.0), rel=1e-6, abs=1e-12)


def test_pressed_from_above_springs_and_inertia_share_the_depth() -> None:
    pressing = Pressing((0.0, 0.0, 1.0, 0.0), 0.002, 5e4, 0.0, 1.0, (0.0, 0.0), (0.0, 0.0, 1.0), REST[:3])
    way, _ = Balance().way(0.2, 1e-4, REST, below(), (pressing,), TICK_S)
    assert way == pytest.approx((0.0, 0.0, -0.002 * 5e4 / (5e4 + 2e4 + 0.2 / TICK_S**2), 0.0), rel=1e-9)


def test_compiled_and_interpreted_find_the_same_bits() -> None:
    plain = interpreted("iiwa_sim.contact.pushed_kernel")
    rng = np.random.default_rng(7)
    for _ in range(20):
        pressing = []
        for _ in range(3):
            out = rng.normal(size=3)
            out /= np.linalg.norm(out)
            x, y = rng.uniform(-0.02, 0.02, 2)
            along = (*out.tolist(), x * out[1] - y * out[0])
            rubbed = rng.uniform(-1e-4, 1e-4, 3).tolist()
            depth, friction = rng.uniform(-1e-4, 1e-3), rng.uniform(0.0, 1.0)
            pressing.append(Pressing(along, depth, 3e4, friction, 5e3, (x, y), tuple(out.tolist()), rubbed))
        velocity = rng.uniform(-0.5, 0.5, 4).tolist()
        ways = [
            kind().way(0.2, 1e-4, velocity, below(), pressing, TICK_S) for kind in (Balance, plain.Balance)
        ]
        assert ways[0] == ways[1]
