"""Reference durations of paths: the optimum without jerk limits.

It is a fine backward and forward pass over b = (ds/dt)^2. Backwards the largest b from which
the end can still be reached within velocity and acceleration limits of all joints, solved exactly at many
samples, each a small linear programme in b and dds; forwards with the largest acceleration (reachability
analysis as in TOPP-RA, Pham and Pham 2018).
"""

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.robot.description import RobotDescription

Array = NDArray[np.float64]

SAMPLES = 1000
TINY = 1e-9


def fastest_without_jerk_limit_s(path: Polynomial, description: RobotDescription) -> float:
    """Duration of the path from rest to rest."""
    s, dq, ddq = _shape(path)
    return fastest_along_s(s, dq, ddq, np.array(description.velocity), np.array(description.acceleration))


def fastest_along_s(s: Array, dq: Array, ddq: Array, velocity: Array, acceleration: Array) -> float:
    """Duration from rest to rest of a path with derivatives dq, ddq (m, n) at rising s (m,).

    The limits (rad/s, rad/s^2) are (n,), or (m, n) where they change along the path.
    """
    widths = np.diff(s)
    rate = np.maximum(np.abs(dq), TINY)
    # dds lies between -room + bend b and room + bend b, for every joint.
    room = acceleration / rate
    bend = -np.where(dq < 0.0, -1.0, 1.0) * ddq / rate
    caps = np.minimum((velocity / rate).min(axis=1) ** 2, _largest_with_acceleration(room, bend))
    highest = _backwards(widths, caps, room, bend)
    b = np.zeros(len(s))
    for i, (width, r, k) in enumerate(zip(widths.tolist(), room, bend, strict=False)):
        b[i + 1] = min(b[i] + 2.0 * width * float((r + k * b[i]).min()), highest[i + 1])
    speeds = np.sqrt(b.clip(0.0))
    return float((2.0 * widths / (speeds[1:] + speeds[:-1] + 1e-12)).sum())


def _largest_with_acceleration(room: Array, bend: Array) -> Array:
    """The largest b (m,) for which any dds suits all joints: every upper bound is above every lower one."""
    constants = room[:, :, None] + room[:, None, :]
    slopes = bend[:, None, :] - bend[:, :, None]
    caps: Array = np.where(slopes > TINY, constants / np.maximum(slopes, TINY), np.inf).min(axis=(1, 2))
    return caps


def _backwards(widths: Array, caps: Array, room: Array, bend: Array) -> Array:
    """The largest b (m,) from which the end can still be reached with rest there."""
    highest = np.zeros(len(caps))
    following = 0.0
    for i in range(len(widths) - 1, -1, -1):
        # To reach at most `following`: dds <= (following - b) / (2 width), and at least 0.
        slope = 1.0 / (2.0 * widths[i])
        down, up = slope + bend[i], -slope - bend[i]
        to_following = np.where(down > TINY, (following * slope + room[i]) / np.maximum(down, TINY), np.inf)
        to_rest = np.where(up > TINY, room[i] / np.maximum(up, TINY), np.inf)
        following = max(min(float(to_following.min()), float(to_rest.min()), caps[i]), 0.0)
        highest[i] = following
    return highest


def _shape(path: Polynomial) -> tuple[Array, Array, Array]:
    """Samples of s (m,) and the first two derivatives of the joints (m, n) there, by central differences."""
    fine = np.linspace(0.0, 1.0, 2 * SAMPLES + 1)
    q = np.array([path.joints(x) for x in fine.tolist()])
    first = np.gradient(q, fine, axis=0, edge_order=2)
    second = np.gradient(first, fine, axis=0, edge_order=2)
    return fine[::2], first[::2], second[::2]
