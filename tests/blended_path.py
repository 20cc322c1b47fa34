"""Places on the paths of a blended sequence, found from the joints at every tick.

At each tick the robot is somewhere on the exact path of a move, or inside the region round a corner in which
blending lets it leave the paths: at the TCP a sphere, of `joint move` a ball in joint space. A run is sound
if its ticks can be assigned so in the order of the moves, going forwards on each of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, turn_between
from tests.stepped import Array, SteppedRobot, rotation_exp

Joints = tuple[float, ...]
Flags = NDArray[np.bool_]

OFF_PATH_M = 1e-6
OFF_PATH_RAD = 1e-6  # of the TCP's orientation, and of A3
OFF_JOINT_LINE_RAD = 5e-7  # of a joint: less than 1 um at the TCP
ROUNDING = 1e-8  # of distances, in m or rad
JOINT_MOVE_BLENDING = 0.1  # of the largest distance of a joint
SHORTEST_WAY_M = 1e-6  # of a line that does not count as a turn in place
HALF = 0.5
LARGEST_PART = 0.49  # of a move that lies in a region round one of its ends
SLACK_TICKS = 1.5  # of the path between the last tick on it and the first one off it


@dataclass(frozen=True)
class SentMove:
    """A move as it was accepted: where it begins and ends, and what its path may do at its end."""

    kind: str
    start: Joints
    corner: Joints
    speeds_rel: tuple[float, ...]
    blending_mm: float
    """Radius of the sphere; without meaning for a joint move."""
    tick: int
    """Tick after which it was sent."""

    @property
    def blends_in_joints(self) -> bool:
        """True if its region is a ball in joint space."""
        return self.kind == "joint"

    @property
    def straight(self) -> bool:
        """True if the TCP moves straight; otherwise the joints do."""
        return self.kind.startswith("lin")


@dataclass(frozen=True)
class Ticks:
    """Joints (m, n), and position (m, 3) (m) and orientation (m, 3, 3) of the TCP, tick by tick."""

    q: Array
    p: Array
    r: Array

    @classmethod
    def of(cls, robot: SteppedRobot, joints: list[Joints]) -> Ticks:
        poses = [robot.tcp(q) for q in joints]
        p = np.array([pose.translation for pose in poses])
        return cls(np.array(joints), p, np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3))


@dataclass
class Run:
    """Moves that followed each other from rest, ended by rest at the last corner or by a stop."""

    robot: SteppedRobot
    first: int
    """The tick at which the robot rested before."""
    start: Joints
    moves: list[SentMove]
    last: int = -1
    """The tick at which it rests after them."""
    stopped_at: int | None = None
    """Tick after which it was stopped."""

    @cached_property
    def ticks(self) -> Ticks:
        return Ticks.of(self.robot, self.robot.joints[self.first : self.last + 1])

    @cached_property
    def places(self) -> Places:
        return Places(self)


class Places:
    """Possible places of the robot in a run at each tick.

    Columns of `possible` (m, 2 n - 1): on move 0, blending at its end, on move 1, and so on.
    """

    def __init__(self, run: Run) -> None:
        self.run, self.ticks = run, run.ticks
        robot, ticks, moves = run.robot, run.ticks, run.moves
        m, n = len(ticks.q), len(moves)
        shape = (m, 2 * n - 1)
        allowed = np.zeros(shape, bool)
        leave, enter, forwards = (np.ones(shape, bool) for _ in range(3))
        self.s, self.off = np.zeros((m, n)), np.zeros((m, n))
        self.offset, self.radius = np.zeros((m, max(n - 1, 0))), np.zeros(max(n - 1, 0))
        number = np.arange(m) + run.first
        for i, move in enumerate(moves):
            self.s[:, i], self.off[:, i], rounding = progress(robot, move, ticks)
            s = self.s[:, i]
            allowed[:, 2 * i] = (self.off[:, i] <= 1.0) & (s >= -rounding) & (s <= 1.0 + rounding)
            allowed[:, 2 * i] &= (number > move.tick) | (i == 0)
            forwards[1:, 2 * i] = np.diff(s) >= -rounding
            ahead = SLACK_TICKS * np.abs(np.diff(s)) + rounding
            leave[:-1, 2 * i] = s[:-1] >= HALF - ahead
            enter[1:, 2 * i] = s[1:] <= HALF + ahead
        for i, move in enumerate(moves[:-1]):
            offset, steps = distances(robot, move, ticks)
            radius = self.radius[i] = region_radius(robot, move, moves[i + 1])
            self.offset[:, i] = offset
            inside = offset <= radius * (1.0 + 1e-6) + ROUNDING
            # A move may be blended only once the next one is known.
            allowed[:, 2 * i + 1] = inside & (number > moves[i + 1].tick)
            # Where it turns back at the corner the step over it is short, and those beside it tell its speed.
            around = np.max([steps, np.append(steps[1:], 0.0), np.append(0.0, steps[:-1])], axis=0)
            ahead = radius + SLACK_TICKS * around + ROUNDING
            leave[:-1, 2 * i] &= offset[:-1] <= ahead
            enter[1:, 2 * i + 2] &= offset[1:] <= ahead
        self.allowed = allowed
        self.possible = self._possible(allowed, leave, enter, forwards)

    def _possible(self, allowed: Flags, leave: Flags, enter: Flags, forwards: Flags) -> Flags:
        """Return the places on any sequence through all ticks, from the first move to the last one."""
        m = len(allowed)
        reached = np.zeros_like(allowed)
        reached[0, 0] = allowed[0, 0]
        for k in range(1, m):
            before = reached[k - 1]
            come = np.logical_or.accumulate(before & leave[k - 1])
            reached[k] = allowed[k] & (before & forwards[k])
            reached[k, 1:] |= allowed[k, 1:] & enter[k, 1:] & come[:-1]
            if not reached[k].any():
                raise AssertionError(self._lost(k, before))
        going = np.zeros_like(allowed)
        going[-1] = reached[-1]
        if self.run.stopped_at is None:
            going[-1, :-1] = False
        for k in range(m - 2, -1, -1):
            after = going[k + 1]
            go = np.logical_or.accumulate((after & enter[k + 1])[::-1])[::-1]
            going[k] = reached[k] & after & forwards[k + 1]
            going[k, :-1] |= reached[k, :-1] & leave[k, :-1] & go[1:]
        if not going[0].any():
            raise AssertionError(f"the run never reaches its last move: {self.run.moves[-1]}")
        return going

    def _lost(self, k: int, before: Flags) -> str:
        """Describe the fault at tick k of the run: places are moves, and corners between them."""
        kinds, was = [move.kind for move in self.run.moves], np.flatnonzero(before).tolist()
        return (
            f"tick {k} of the run from tick {self.run.first}, at {self.ticks.q[k].tolist()}, was at one "
            f"of the places {was} of {kinds}; now {self.off[k]} tolerances off moves at s = {self.s[k]}, and "
            f"{self.offset[k]} from the corners, whose regions are {self.radius}"
        )

    def passed(self, corner: int) -> bool:
        """Return True if a corner was certainly passed before the run ended."""
        return not self.possible[-1, : 2 * corner + 2].any()

    def at(self, corner: int) -> Flags:
        """Return ticks (m,) on the move before the corner, on the one after it, or blending between them."""
        return self.possible[:, 2 * corner : 2 * corner + 3].any(axis=1)

    def speed_caps(self) -> Array:
        """Return the largest relative speed of each joint that any place it may be in allows (m, n)."""
        speeds = np.array([move.speeds_rel for move in self.run.moves])
        columns = np.zeros((self.possible.shape[1], speeds.shape[1]))
        columns[::2] = speeds
        columns[1::2] = np.maximum(speeds[:-1], speeds[1:])
        caps: Array = np.where(self.possible[:, :, None], columns, 0.0).max(axis=1)
        return caps


def progress(robot: SteppedRobot, move: SentMove, ticks: Ticks) -> tuple[Array, Array, float]:
    """Return the path parameter of each tick on a move (m,) and its deviation in tolerances (m,).

    The third value is the rounding of the first. For a move of no length the parameter is always half.
    """
    delta = np.subtract(move.corner, move.start)
    if np.abs(delta).max() < OFF_JOINT_LINE_RAD:
        return _nowhere(np.abs(ticks.q - move.corner).max(axis=1) / OFF_JOINT_LINE_RAD)
    if not move.straight:
        s = (ticks.q - move.start) @ delta / (delta @ delta)
        off = np.abs(ticks.q - move.start - s[:, None] * delta).max(axis=1) / OFF_JOINT_LINE_RAD
        return s, off, ROUNDING / float(np.abs(delta).max())
    start, end = robot.tcp(move.start), robot.tcp(move.corner)
    shift = np.subtract(end.translation, start.translation)
    length = float(np.linalg.norm(shift))
    axis, angle = _turn(start, end)
    a3_delta = delta[2] if robot.redundant else 0.0
    done = ticks.r @ np.array(start.rotation).reshape(3, 3).T
    turned = np.arctan2(axis @ _skew(done) / 2.0, (np.trace(done, axis1=1, axis2=2) - 1.0) / 2.0)
    if length > SHORTEST_WAY_M:
        s, rounding = (ticks.p - start.translation) @ shift / length**2, ROUNDING / length
    elif angle > OFF_PATH_RAD:
        s, rounding = turned / angle, ROUNDING / angle
    elif abs(a3_delta) > OFF_PATH_RAD:
        s, rounding = (ticks.q[:, 2] - move.start[2]) / a3_delta, ROUNDING / abs(a3_delta)
    else:
        return _nowhere(
            np.abs(ticks.q - move.corner).max(axis=1) / (OFF_JOINT_LINE_RAD + np.abs(delta).max())
        )
    off_line = np.linalg.norm(ticks.p - start.translation - s[:, None] * shift, axis=1)
    expected = rotation_exp(s[:, None] * (angle * axis)) @ np.array(start.rotation).reshape(3, 3)
    off_arc = np.linalg.norm(expected - ticks.r, axis=(1, 2)) / np.sqrt(2.0)
    off_a3 = np.abs(ticks.q[:, 2] - move.start[2] - s * a3_delta) * robot.redundant
    off = np.max([off_line / OFF_PATH_M, off_arc / OFF_PATH_RAD, off_a3 / OFF_PATH_RAD], axis=0)
    return s, off, rounding


def distances(robot: SteppedRobot, move: SentMove, ticks: Ticks) -> tuple[Array, Array]:
    """Return distances of each tick to the end of a move (m,), and to the next tick (m - 1,): m, or rad."""
    if move.blends_in_joints:
        return np.abs(ticks.q - move.corner).max(axis=1), np.abs(np.diff(ticks.q, axis=0)).max(axis=1)
    corner = robot.tcp(move.corner).translation
    return np.linalg.norm(ticks.p - corner, axis=1), np.linalg.norm(np.diff(ticks.p, axis=0), axis=1)


def region_radius(robot: SteppedRobot, move: SentMove, following: SentMove) -> float:
    """Return the radius of blending at the end of a move, clipped to half of both moves: m, or rad."""
    if move.blends_in_joints:
        radius = JOINT_MOVE_BLENDING * float(np.abs(np.subtract(move.corner, move.start)).max())
        half = HALF * float(np.abs(np.subtract(following.corner, following.start)).max())
        return radius if following.straight else min(radius, half)
    radius = move.blending_mm / 1000.0
    return min(radius, _half_m(robot, move, at_end=True), _half_m(robot, following, at_end=False))


def _half_m(robot: SteppedRobot, move: SentMove, at_end: bool) -> float:
    """Return the greatest distance (m) of the TCP from one end of a move within that half of it.

    A move that turns in place has no limit: half of its turn is one, which `Places` checks.
    """
    start, end = np.array(move.start), np.array(move.corner)
    corner = robot.tcp(end if at_end else start).translation
    if move.straight:
        other = robot.tcp(start if at_end else end).translation
        length = float(np.linalg.norm(np.subtract(corner, other)))
        return HALF * length if length > SHORTEST_WAY_M else np.inf

    def offsets(parts: Array) -> Array:
        places = [robot.tcp(tuple(start + part * (end - start))).translation for part in parts]
        return np.linalg.norm(np.subtract(places, corner), axis=1)

    low, high = (HALF, 1.0) if at_end else (0.0, HALF)
    parts = np.linspace(low, high, 21)
    at, step = parts[offsets(parts).argmax()], parts[1] - parts[0]
    # It may be farthest between two of these: a path of joints may turn back within its half.
    farthest = float(offsets(np.linspace(max(at - step, low), min(at + step, high), 81)).max())
    return farthest if farthest > SHORTEST_WAY_M else np.inf


def _nowhere(off: Array) -> tuple[Array, Array, float]:
    return np.full(len(off), HALF), off, 0.0


def _skew(r: Array) -> Array:
    """Return axes (3, m) of rotations (m, 3, 3), times twice the sines of their angles."""
    return np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]])


def _turn(start: Transform, end: Transform) -> tuple[Array, float]:
    """Return axis and angle from one orientation to another."""
    axis, angle = turn_between(start.rotation, end.rotation)
    return np.array(axis), angle
