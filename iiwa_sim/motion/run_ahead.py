"""A run of chains as the override looks at it."""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.run import Run


class RunAhead:
    """The derivatives of a run over planned time."""

    def __init__(self, run: Run, version: int) -> None:
        self._run = run
        self.version = version

    def along(self, times: Array) -> tuple[Array, Array]:
        """At evenly rising times (s) positions and their derivatives (m, 4, n), and the limits (m, 3, n)."""
        # Half as far apart, so that a jump of the jerk shows in the samples beside it only.
        run, h = self._run, 0.5 * float(times[1] - times[0])
        around = times[0] + h * np.arange(-2, 2 * len(times) + 1)
        q = run.joints_along(around.clip(0.0, np.nextafter(run.rest_s, 0.0)))
        first = (q[3:-1] - q[1:-3]) / (2.0 * h)
        second = (q[3:-1] - 2.0 * q[2:-2] + q[1:-3]) / h**2
        third = (q[4:] - 2.0 * q[3:-1] + 2.0 * q[1:-3] - q[:-4]) / (2.0 * h**3)
        return np.stack([q[2:-2], first, second, third], axis=1)[::2], self._limits(times)

    def _limits(self, times: Array) -> Array:
        run = self._run
        limits = {move.number: np.stack(move.limits) for move in run.moves_from(0)}
        first = next(iter(limits.values()))
        if all((each[1:] == first[1:]).all() for each in limits.values()):  # velocities do not matter here
            return np.broadcast_to(first, (len(times), *first.shape))
        return np.array([limits[run.move_at(time_s)] for time_s in times.clip(0.0, run.rest_s).tolist()])
