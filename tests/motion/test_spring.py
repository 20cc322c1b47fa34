"""A mass on a spring: exact whatever the step."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.spring import damping, spring


@given(
    mass=st.floats(0.1, 10.0),
    stiffness=st.floats(0.0, 5000.0),
    least=st.floats(0.0, 50.0),
    x=st.floats(-1.0, 1.0),
    v=st.floats(-2.0, 2.0),
    f=st.floats(-100.0, 100.0),
    step_s=st.sampled_from([0.0005, 0.002, 0.01]),
)
def test_one_step_is_as_good_as_many(
    mass: float, stiffness: float, least: float, x: float, v: float, f: float, step_s: float
) -> None:
    damped = damping(mass, stiffness, least)
    once = spring(mass, stiffness, damped, step_s).reshape(2, 3) @ [x, v, f]
    # Fourth order Runge-Kutta, in small steps.
    h, (y, u) = step_s / 200, (x, v)
    for _ in range(200):

        def rate(y: float, u: float) -> tuple[float, float]:
            return u, (f - damped * u - stiffness * y) / mass

        a = rate(y, u)
        b = rate(y + h / 2 * a[0], u + h / 2 * a[1])
        c = rate(y + h / 2 * b[0], u + h / 2 * b[1])
        d = rate(y + h * c[0], u + h * c[1])
        y += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        u += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
    assert tuple(once) == pytest.approx((y, u), rel=1e-6, abs=1e-8)


def test_damping_has_the_ratio_and_a_least_value() -> None:
    assert damping(5.0, 2000.0) == pytest.approx(2 * 0.7 * (5.0 * 2000.0) ** 0.5)
    assert damping(5.0, 0.0, 20.0) == 20.0
