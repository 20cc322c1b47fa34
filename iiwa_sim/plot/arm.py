"""The arm as a line through its joints, and the instants at which a picture shows it."""

from collections.abc import Sequence

import numpy as np

from iiwa_sim.frames import IDENTITY, Transform, compose, rotation_about
from iiwa_sim.plot.record import Array, Recording
from iiwa_sim.robot.model import Model

INSTANTS = 5
"""Instants at which a picture shows the arm, unless it does not move."""


def arm_mm(recording: Recording, tick: int) -> Array:
    """Base, joints base first, flange and TCP at a tick: (joints + 3, 3), mm in the base."""
    steps = Model(recording.description).fixed_poses
    return _points_mm(steps, recording.joints[tick].tolist(), recording.tcp_mm[tick])


def flange(recording: Recording, tick: int) -> Transform:
    """The flange in the base at a tick (m)."""
    return Model(recording.description).flange(recording.joints[tick].tolist())


def instants(recording: Recording) -> list[int]:
    """Ticks at even times, from the first to the last; the first alone where no joint moves at all."""
    if not np.ptp(recording.joints, axis=0).any():
        return [0]
    last = len(recording.joints) - 1
    return sorted({round(last * each / (INSTANTS - 1)) for each in range(INSTANTS)})


def _points_mm(steps: Sequence[Transform], joints: Sequence[float], tcp_mm: Array) -> Array:
    points, frame = [IDENTITY.translation], IDENTITY
    for step, joint in zip(steps[:-1], joints, strict=True):
        frame = compose(frame, step)
        points.append(frame.translation)
        frame = compose(frame, Transform(rotation_about((0.0, 0.0, 1.0), joint), IDENTITY.translation))
    points.append(compose(frame, steps[-1]).translation)
    return np.vstack([1e3 * np.array(points), tcp_mm])
