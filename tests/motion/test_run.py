"""The fastest run along a path, without limits of jerk."""

import numpy as np
import pytest

from iiwa_sim.motion.plan_kernel import run

LIMITS = 2.0, 3.0, 1e6  # velocity, acceleration, jerk: the last one bounds nothing here


@pytest.mark.parametrize("turns_at", np.linspace(0.47, 0.53, 7).tolist())
def test_a_joint_that_turns_back_between_samples_does_not_stop_the_run(turns_at: float) -> None:
    """One joint goes along a parabola of x, so it passes its turning point at the speed at which all of its
    acceleration bends it; the other goes evenly."""
    samples = np.linspace(0.0, 1.0, 17)
    bend = np.full_like(samples, 40.0)
    slope = bend * (samples - turns_at)
    zero, one = np.zeros_like(samples), np.ones_like(samples)
    derivatives = np.stack(
        [
            np.stack([0.5 * slope**2 / 40.0, samples], axis=1),
            np.stack([slope, one], axis=1),
            np.stack([bend, zero], axis=1),
            np.stack([zero, zero], axis=1),
        ],
        axis=1,
    )
    limits = np.ones((len(samples), 3, 2)) * np.array(LIMITS)[:, np.newaxis]
    speeds, times = np.empty((2, len(samples)))
    run(samples, derivatives, limits, 0.0, speeds, times)
    even = np.sqrt(LIMITS[1] / 40.0)
    inside = np.abs(samples - turns_at) < 0.2
    assert speeds[inside].min() > 0.8 * even
    assert speeds[inside].max() < 1.2 * even
