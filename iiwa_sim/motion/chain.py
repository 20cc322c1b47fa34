"""A chain: moves that are driven on into each other without a stop, from rest to rest.

Its parameter x joins their paths and the blends between them. Each path counts as long as its joints take at
the least at the speed of its move, so that x goes about as fast as time.
"""

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from iiwa_sim.motion.bounds import Bounds, joined
from iiwa_sim.motion.chain_timing import from_rest, going_on
from iiwa_sim.motion.corner import Corner, window_of
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.sampled_path import Joints, Path
from iiwa_sim.motion.slices import Slices, at_once
from iiwa_sim.motion.smooth import SmoothTiming

TOO_LATE = 1e-6  # in x before a blend: it counts as begun
GENTLE = 1.5  # windows of the moving average, during which a chain sets out or comes to rest with a share


class _Curve(Protocol):
    def joints(self, x: float) -> Joints: ...

    def joints_along(self, x: Array) -> Array: ...


class _Lengthened:
    """A path over its length in x instead of 0..1."""

    def __init__(self, path: Path, length: float) -> None:
        self._path = path
        self._length = length

    def joints(self, x: float) -> Joints:
        return self._path.joints(x / self._length)

    def joints_along(self, x: Array) -> Array:
        return self._path.joints_along(x / self._length)


class _Piece(NamedTuple):
    start: float
    """The x from which on the chain follows this curve,"""
    origin: float
    """and that at which the curve would begin."""
    curve: _Curve


class _Geometry(NamedTuple):
    """Where a chain goes."""

    moves: list[Move]
    targets: list[float]
    """The x of the target of each move: that of a corner is inside its blend."""
    pieces: list[_Piece]
    bounds: Bounds

    @classmethod
    def of(cls, move: Move) -> "_Geometry":
        piece = _Piece(0.0, 0.0, _Lengthened(move.path, move.length_s))
        return cls([move], [move.length_s], [piece], _bounds(move))

    def gone_on(self, move: Move, corner: Corner) -> "_Geometry":
        """With another move blended into the last one."""
        target = self.targets[-1]
        blend = corner.blend
        start = target - corner.before
        over_blend = corner.bounds.moved(start)
        end = float(over_blend.s[-1])
        on_path = _bounds(move).moved(target)
        return _Geometry(
            [*self.moves, move],
            [*self.targets, target + move.length_s],
            [
                *self.pieces,
                _Piece(start, start, blend),
                _Piece(end, target, _Lengthened(move.path, move.length_s)),
            ],
            joined([self.bounds.upto(start), over_blend, on_path.starting(end)]),
        )

    def left(self, x: float) -> "_Geometry":
        """What of it is left from x on."""
        first = max(bisect_right([piece.start for piece in self.pieces], x) - 1, 0)
        gone = min(bisect_right(self.targets, x), len(self.targets) - 1)
        moves, targets = self.moves[gone:], self.targets[gone:]
        return _Geometry(moves, targets, self.pieces[first:], self.bounds.starting(x))

    def alone(self) -> "_Geometry | None":
        """Its first move without those behind it; None where a blend into the next has begun."""
        move, target = self.moves[0], self.targets[0]
        paths = [isinstance(each.curve, _Lengthened) and each.start < target for each in self.pieces]
        if True not in paths:
            return None
        count = paths.index(True) + 1
        bounds = self.bounds
        if count < len(self.pieces):
            start = self.pieces[count].start
            if start - self.bounds.s[0] < TOO_LATE:
                return None
            on_path = _bounds(move).moved(target - move.length_s)
            bounds = joined([bounds.upto(start), on_path.starting(start)])
        return _Geometry([move], [target], self.pieces[:count], bounds)


class Plan(NamedTuple):
    """Where a chain goes, and when."""

    timing: SmoothTiming
    geometry: _Geometry


class Way:
    """The moves of a chain, and the corners between them that are driven round."""

    def __init__(self, move: Move) -> None:
        self.first = self.last = move
        self.corners: list[tuple[Corner, Move]] = []
        self.length_s = move.length_s
        self.end_share = 1.0
        """The part of the acceleration limits to brake with at its end."""

    def after_first(self, count: int) -> "Way":
        """The part of it from its second move on, with so many moves."""
        rest = Way(self.corners[0][1])
        for corner, move in self.corners[1:count]:
            rest.go_on(corner, move)
        if count == len(self.corners):
            rest.end_share = self.end_share
        return rest

    def go_on(self, corner: Corner, move: Move) -> None:
        """Round a corner into another move."""
        self.corners.append((corner, move))
        self.length_s += move.length_s
        self.last = move


class Chain:
    """At rest at the start of its first move at time 0, and at rest at the target of its last."""

    def __init__(self, plan: Plan, end_share: float, ungentle: _Geometry | None) -> None:
        """Comes to rest with a part of the acceleration limits; `ungentle` is its geometry without that, None
        where it is the whole."""
        self.plan = plan
        self._end_share = end_share
        self._ungentle = ungentle

    @classmethod
    def along(cls, way: Way, share: float = 1.0) -> "Slices[Chain]":
        """`share` is the part of the acceleration limits with which it sets out."""
        geometry = _Geometry.of(way.first)
        for corner, move in way.corners:
            geometry = geometry.gone_on(move, corner)
        window_s, bounds = window_of(way.first.limits), geometry.bounds
        if share < 1.0:
            bounds = bounds.gentler(0.0, _gentle_way(bounds, 0, window_s, way.first, share), share)
        geometry = geometry._replace(bounds=bounds)
        bounds = _ending_gently(bounds, window_s, way.last, way.end_share, 0.0)
        yield
        timing, bounds = yield from from_rest(bounds, window_s)
        ungentle = geometry if way.end_share < 1.0 else None
        return cls(Plan(timing, geometry._replace(bounds=bounds)), way.end_share, ungentle)

    def driven_on(self, way: Way, now_s: float, time_s: float) -> "Slices[tuple[Chain, int]]":
        """The same that goes on into moves that follow the last one, as many as possible without changing
        anything before a time; and how many these are."""
        geometry = self.plan.geometry.left(self.plan.timing.position(now_s))
        front = self.plan.timing.front(time_s)[0]
        stages = []
        for corner, move in way.corners:
            if geometry.targets[-1] - corner.before <= front:
                break
            geometry = geometry.gone_on(move, corner)
            stages.append(geometry)
        yield
        for count in sorted({len(stages), 1} if stages else (), reverse=True):
            geometry = stages[count - 1]
            share = way.end_share if count == len(way.corners) else 1.0
            bounds = _ending_gently(
                geometry.bounds, self.plan.timing.window_s, geometry.moves[-1], share, front
            )
            planned = yield from going_on(self.plan.timing, bounds, now_s, time_s)
            if planned is not None:
                plan = Plan(planned[0], geometry._replace(bounds=planned[1]))
                return Chain(plan, share, geometry if share < 1.0 else None), count
            yield
        return self, 0

    def braking(self, share: float, now_s: float, time_s: float) -> "Slices[Chain]":
        """The same with a part of the acceleration limits to come to rest with, if that is possible without
        changing anything before a time; else as it is."""
        if share >= self._end_share:
            return self
        timing, ungentle = self.plan.timing, self._ungentle or self.plan.geometry
        geometry = self.plan.geometry.left(timing.position(now_s))
        front = timing.front(time_s)[0]
        bounds = _ending_gently(geometry.bounds, timing.window_s, self.moves[-1], share, front)
        yield
        planned = yield from going_on(timing, bounds, now_s, time_s)
        if planned is None:
            return self
        return Chain(Plan(planned[0], geometry._replace(bounds=planned[1])), share, ungentle)

    def braking_fully(self, now_s: float, time_s: float) -> "Slices[Chain]":
        """The same with all of the acceleration limits to come to rest with, if that is earlier."""
        if self._ungentle is None:
            return self
        geometry = self._ungentle.left(self.plan.timing.position(now_s))
        planned = yield from going_on(self.plan.timing, geometry.bounds, now_s, time_s)
        if planned is None or planned[0].rest_s >= self.rest_s:
            return self
        return Chain(Plan(planned[0], geometry._replace(bounds=planned[1])), 1.0, None)

    def end_with_move_at(self, time_s: float) -> bool:
        """Let the move that is under way at a time be the last one.

        False, and nothing is changed, where the robot has begun to leave its path for the next one's, or is
        too fast to rest at its target.
        """
        if self.waiting(time_s):
            geometry = self.plan.geometry.left(self.plan.timing.position(time_s)).alone()
            planned = geometry and at_once(going_on(self.plan.timing, geometry.bounds, time_s, time_s))
            if geometry is None or planned is None:
                return False
            self.plan = Plan(planned[0], geometry._replace(bounds=planned[1]))
            self._end_share, self._ungentle = 1.0, None
        return True

    @property
    def moves(self) -> Sequence[Move]:
        """Those that are not done."""
        return self.plan.geometry.moves

    @property
    def rest_s(self) -> float:
        """When the robot is at rest at the end."""
        return self.plan.timing.rest_s

    @property
    def end(self) -> Joints:
        """Where that is (rad)."""
        return self.plan.geometry.moves[-1].path.end

    def time_of(self, move: Move, s: float) -> float:
        """When it passes an s of the path of one of its moves."""
        k = self.plan.geometry.moves.index(move)
        return self.plan.timing.time_at(self.plan.geometry.targets[k] - (1.0 - s) * move.length_s)

    def waiting(self, time_s: float) -> int:
        """How many of its moves have not begun at a time."""
        return len(self.plan.geometry.moves) - 1 - self._place(time_s)

    def move_at(self, time_s: float) -> int:
        """The number of the move that is under way at a time."""
        return self.plan.geometry.moves[self._place(time_s)].number

    def _place(self, time_s: float) -> int:
        targets = self.plan.geometry.targets
        return min(bisect_right(targets, self.plan.timing.position(time_s)), len(targets) - 1)

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad) at a time."""
        if time_s >= self.rest_s:
            return self.end
        x = self.plan.timing.position(time_s)
        pieces = self.plan.geometry.pieces
        k = len(pieces) - 1
        while k and pieces[k].start > x:
            k -= 1
        return pieces[k].curve.joints(x - pieces[k].origin)

    def joints_along(self, times: Array) -> Array:
        """The same (m, n) at rising times (m,) before `rest_s`, for less where there are many."""
        x = self.plan.timing.positions(times)
        pieces = self.plan.geometry.pieces
        starts = [piece.start for piece in pieces]
        borders = x.searchsorted(starts).tolist()
        borders[0] = 0
        parts = [
            piece.curve.joints_along(x[first:last] - piece.origin)
            for piece, first, last in zip(pieces, borders, [*borders[1:], len(x)], strict=True)
            if first < last
        ]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _ending_gently(bounds: Bounds, window_s: float, last: Move, share: float, front: float) -> Bounds:
    """With a part of the acceleration limits to come to rest with, where that is ahead of the front."""
    end = float(bounds.s[-1])
    start = end - _gentle_way(bounds, -1, window_s, last, share)
    if share >= 1.0 or start <= max(float(bounds.s[0]), front):
        return bounds
    return bounds.gentler(start, end, share)


def _gentle_way(bounds: Bounds, end: int, window_s: float, move: Move, share: float) -> float:
    """How far the robot goes while it sets out or comes to rest gently, at an end (0 or -1) of the bounds."""
    way = 0.5 * share * float(bounds.room[:, end].min()) * (GENTLE * window_s) ** 2
    return min(way, 0.5 * move.length_s)


def _bounds(move: Move) -> Bounds:
    return Bounds.of(move.path.samples.scaled(move.length_s), move.limits, move.limits.velocity)
