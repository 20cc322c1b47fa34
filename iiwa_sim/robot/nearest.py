"""Selects among all joint positions that reach a target the one that a move goes to.

A target leaves the branch open, and the redundancy (the position of A3: the elbow) unless it is given. The
rule: keep both if that reaches the target within the joint limits; otherwise change as little as possible.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.wording import distinct

OUT_OF_REACH = 3021
"""The arm is too short for the target or cannot fold that far, whatever its redundancy."""
ROBOT_CONFIGURATION = 3022
"""The target is reachable, but not with the redundancy given or on the branch to be kept."""
JOINT_LIMIT = 3023
"""The target is reachable but for a joint limit."""

_GRID_RAD = radians(1.0)
_COARSE_GRID_RAD = radians(3.0)


class Unreachable(Exception):
    """No joint positions reach the target. `code` is one of the published codes above, `reason` one line."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason


class Solution(NamedTuple):
    joints: tuple[float, ...]
    """rad, within the limits"""
    status: int
    """The branch they are on."""
    changed: bool
    """True if the redundancy (unless given) or the status differs from that of the present joints."""


class _Candidates(NamedTuple):
    joints: NDArray[np.float64]
    """(N, n), NaN where out of reach"""
    statuses: NDArray[np.int64]
    redundancies: NDArray[np.float64]
    feasible: NDArray[np.bool_]

    def least(self, costs: NDArray[np.float64]) -> Solution:
        """Return the feasible row of least cost."""
        row = int(np.where(self.feasible, costs, np.inf).argmin())
        return Solution(tuple(self.joints[row].tolist()), int(self.statuses[row]), changed=True)


class Nearest:
    """The rule for one robot."""

    def __init__(self, inverse: Inverse, description: RobotDescription) -> None:
        self._inverse = inverse
        self._names = description.joints
        self._low, self._high = np.array(description.position_min), np.array(description.position_max)

    def find(
        self,
        flange: Transform,
        present: Sequence[float],
        redundancy: float | None = None,
        keep_status: bool = False,
    ) -> Solution:
        """Return joint positions for a pose of the flange (in the base, m); `present` is the start (rad).

        Without `redundancy` (rad) the present one is kept if it serves. Else it becomes the nearest one that
        serves on the present branch, to 1 deg. If none does, the joint positions of other branches nearest to
        the present ones are taken. A given redundancy is kept exactly, on the present branch if it serves,
        else on the branch nearest in joints. At a singular pose every branch that meets there is a present
        one. A joint that can reach a position by several turns takes the nearest.
        `keep_status` rules the other branches out, as a straight line must.

        Raises `Unreachable`.
        """
        inverse = self._inverse
        own = inverse.merging_statuses(present)
        others = [status for status in inverse.statuses if status not in own]
        limits = inverse.redundancy_range
        kept = inverse.redundancy(present) if redundancy is None else redundancy
        if redundancy is not None and limits is not None and not limits[0] <= redundancy <= limits[1]:
            at, low, high = distinct(redundancy, *limits)
            raise Unreachable(JOINT_LIMIT, f"the redundancy of {at} rad is outside {low} to {high} rad")
        searched = None if redundancy is not None else limits
        found = inverse.nearest(flange, kept, own, present)
        if found is not None:
            return Solution(*found, changed=False)
        candidates = self._candidates(flange, _grid(kept, searched, _GRID_RAD), own, present)
        if candidates.feasible.any():
            return candidates.least(np.abs(candidates.redundancies - kept))
        elsewhere = self._candidates(flange, _grid(kept, searched, _COARSE_GRID_RAD), others, present)
        if keep_status or not elsewhere.feasible.any():
            raise self._reason(flange, redundancy, candidates, elsewhere, present)
        return elsewhere.least(((elsewhere.joints - present) ** 2).sum(axis=1))

    def _candidates(
        self,
        flange: Transform,
        redundancies: NDArray[np.float64],
        statuses: Sequence[int],
        present: Sequence[float],
    ) -> _Candidates:
        """Return joint positions for every redundancy on every branch."""
        every_redundancy = np.tile(redundancies, len(statuses))
        every_status = np.repeat(np.array(statuses, dtype=np.int64), len(redundancies))
        joints = self._inverse.joints_batch(flange, every_redundancy, every_status, present)
        joints, feasible = self._inverse.turned(joints, present)
        return _Candidates(joints, every_status, every_redundancy, feasible)

    def _reason(
        self,
        flange: Transform,
        redundancy: float | None,
        own: _Candidates,
        others: _Candidates,
        present: Sequence[float],
    ) -> Unreachable:
        if others.feasible.any():
            status = int(others.statuses[others.feasible][0])
            reason = f"the target is reachable only with the arm bent another way (status {status})"
            return Unreachable(ROBOT_CONFIGURATION, f"{reason}: go there by PTP")
        joints = np.concatenate((own.joints, others.joints))
        joints = joints[~np.isnan(joints).any(axis=1)]
        if len(joints):
            return self._blocking(joints)
        if redundancy is not None:
            every = _grid(redundancy, self._inverse.redundancy_range, _COARSE_GRID_RAD)
            anywhere = self._candidates(flange, every, self._inverse.statuses, present)
            if not np.isnan(anywhere.joints).all():
                reason = f"the target is out of reach with a redundancy of {redundancy:.7g} rad"
                return Unreachable(ROBOT_CONFIGURATION, reason)
        x, y, z = (1e3 * value for value in flange.translation)
        far = how_far(self._inverse.beyond_reach(flange))
        return Unreachable(OUT_OF_REACH, f"the flange at {x:.1f} {y:.1f} {z:.1f} mm is out of reach{far}")

    def _blocking(self, joints: NDArray[np.float64]) -> Unreachable:
        """Return the joint whose limit is the obstacle where limits are exceeded the least."""
        excess = np.maximum(np.subtract(self._low, joints), np.subtract(joints, self._high)).clip(min=0.0)
        row = int(excess.max(axis=1).argmin())
        joint = int(excess[row].argmax())
        low, high = self._low[joint], self._high[joint]
        where = f"{self._names[joint]} would have to be at {joints[row, joint]:.7g} rad"
        return Unreachable(JOINT_LIMIT, f"{where}, its limits are {low:.7g} and {high:.7g} rad")


def how_far(beyond_m: float) -> str:
    """Return the words for a distance beyond reach, as of `Inverse.beyond_reach`; empty within reach."""
    if beyond_m > 0.0:
        return f": farther than the arm reaches by {1e3 * beyond_m:.4g} mm"
    if beyond_m < 0.0:
        return f": nearer to the shoulder than the arm folds by {-1e3 * beyond_m:.4g} mm"
    return ""


def _grid(centre: float, limits: tuple[float, float] | None, step: float) -> NDArray[np.float64]:
    """Return points within the limits at multiples of `step` from the centre, and the limits."""
    if limits is None:
        return np.array([centre])
    low, high = limits
    first, last = int(np.ceil((low - centre) / step)), int(np.floor((high - centre) / step))
    return np.concatenate(([low], centre + step * np.arange(first, last + 1), [high]))
