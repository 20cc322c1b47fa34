"""The fastest a path can be run at all: without jerk limits, and a straight joint line with them.

Without: a fine backward and forward pass over b = (ds/dt)^2. Backwards the largest b from which the end can
still be reached within velocity and acceleration limits of all joints, solved exactly at many samples, each
a small linear programme in b and dds; forwards with all the acceleration there is (reachability analysis as
in TOPP-RA, Pham and Pham 2018). With: Ruckig.
"""

import numpy as np
from numpy.typing import NDArray
from ruckig import InputParameter, Ruckig, Synchronization, Trajectory

from iiwa_sim.motion.path import Path
from iiwa_sim.robot.description import RobotDescription

SAMPLES = 1000
TINY = 1e-9


def fastest_without_jerk_limit_s(path: Path, description: RobotDescription) -> float:
    """Duration of the path from rest to rest."""
    s, dq, ddq = _shape(path)
    width = s[1]
    rate = np.maximum(np.abs(dq), TINY)
    velocity_cap = (np.array(description.velocity) / rate).min(axis=1) ** 2
    # dds lies between -room + bend b and room + bend b, for every joint.
    room = np.array(description.acceleration) / rate
    bend = -np.where(dq < 0.0, -1.0, 1.0) * ddq / rate
    highest = np.zeros(len(s))
    for i in range(len(s) - 2, -1, -1):
        upper = np.append(room[i], highest[i + 1] / (2.0 * width)), np.append(bend[i], -1.0 / (2.0 * width))
        lower = np.append(-room[i], 0.0), np.append(bend[i], -1.0 / (2.0 * width))
        # Every upper bound lies above every lower one: (difference of constants) >= (difference of slopes) b.
        constants = upper[0][:, None] - lower[0]
        slopes = lower[1] - upper[1][:, None]
        caps = np.where(slopes > TINY, constants / np.maximum(slopes, TINY), np.inf)
        highest[i] = min(float(caps.min()), velocity_cap[i])
    b = np.zeros(len(s))
    for i in range(len(s) - 1):
        acceleration = float((room[i] + bend[i] * b[i]).min())
        b[i + 1] = min(b[i] + 2.0 * width * acceleration, highest[i + 1])
    speeds = np.sqrt(b.clip(0.0))
    return float((2.0 * width / (speeds[1:] + speeds[:-1] + 1e-12)).sum())


def _shape(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Samples of s (m,) and the first two derivatives of the joints (m, n) there, by central differences."""
    fine = np.linspace(0.0, 1.0, 2 * SAMPLES + 1)
    q = np.array([path.joints(x) for x in fine.tolist()])
    first = np.gradient(q, fine, axis=0, edge_order=2)
    second = np.gradient(first, fine, axis=0, edge_order=2)
    return fine[::2], first[::2], second[::2]


def ruckig_s(path: Path, description: RobotDescription) -> float:
    """Duration of the straight joint line of the path by Ruckig, all joints phase-synchronised."""
    start, end = path.joints(0.0), path.end
    task = InputParameter(len(start))
    task.current_position, task.target_position = list(start), list(end)
    task.max_velocity = list(description.velocity)
    task.max_acceleration, task.max_jerk = list(description.acceleration), list(description.jerk)
    task.synchronization = Synchronization.Phase
    trajectory = Trajectory(len(start))
    Ruckig(len(start)).calculate(task, trajectory)
    duration: float = trajectory.duration
    return duration
