"""A chain: moves that run into each other without a stop, from rest to rest.

Its parameter x joins their paths and the blends between them. Each path counts as long as its joints take at
the least at the speed of its move, so that x goes about as fast as time.
"""

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from iiwa_sim.motion.bounds import Bounds, joined
from iiwa_sim.motion.chain_timing import from_rest, going_on, window_of
from iiwa_sim.motion.corner import Corner, rounded
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints, Path


class _Curve(Protocol):
    def joints(self, x: float) -> Joints: ...

    def joints_along(self, x: Array) -> list[Joints]: ...


class _Lengthened:
    """A path over its length in x instead of 0..1."""

    def __init__(self, path: Path, length: float) -> None:
        self._path = path
        self._length = length

    def joints(self, x: float) -> Joints:
        return self._path.joints(x / self._length)

    def joints_along(self, x: Array) -> list[Joints]:
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
        velocity = blend.velocity_limits(self.moves[-1].limits, move.limits)
        over_blend = Bounds.of(blend.samples(), move.limits, velocity).moved(start)
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
        return _Geometry(self.moves[gone:], self.targets[gone:], self.pieces[first:], self.bounds.starting(x))


class Chain:
    """At rest at the start of its first move at time 0, and at rest at the target of its last."""

    def __init__(self, move: Move, waiting: Sequence[Move], lowest: Array, highest: Array) -> None:
        """Of a move and as many of those that wait as blend into it and into each other.

        The limits of joint positions are in rad (n,).
        """
        self._position_limits = lowest, highest
        self.open = True
        """Whether another move may still blend into the last one."""
        stages = self._stages(_Geometry.of(move), waiting, 0.0)
        self._timing, bounds = from_rest(stages[-1].bounds, window_of(move.limits))
        self._geometry = stages[-1]._replace(bounds=bounds)
        self.taken = len(stages)
        """How many moves it has begun with."""

    def take(self, waiting: Sequence[Move], time_s: float) -> int:
        """Blend more moves into the last one, from a time on; returns how many.

        Those that cannot be, because the robot is already too far or too fast, are left; then the chain is
        no longer open.
        """
        left = self._geometry.left(self._timing.position(time_s))
        stages = self._stages(left, waiting, self._timing.front(time_s)[0])
        for count in sorted({len(stages) - 1, 1}, reverse=True):
            if 0 < count < len(stages):
                planned = going_on(self._timing, stages[count].bounds, time_s)
                if planned is not None:
                    self._timing, bounds = planned
                    self._geometry = stages[count]._replace(bounds=bounds)
                    return count
        self.open = False
        return 0

    def _stages(self, geometry: _Geometry, moves: Sequence[Move], front: float) -> list[_Geometry]:
        """A geometry with 0, 1, ... more moves, as far as there are corners ahead of the front to cut."""
        stages = [geometry]
        for move in moves:
            corner = rounded(geometry.moves[-1], move, *self._position_limits)
            if corner is None or geometry.targets[-1] - corner.before <= front:
                self.open = False
                break
            geometry = geometry.gone_on(move, corner)
            stages.append(geometry)
        return stages

    @property
    def rest_s(self) -> float:
        """When the robot is at rest at the end."""
        return self._timing.rest_s

    @property
    def end(self) -> Joints:
        """Where that is (rad)."""
        return self._geometry.moves[-1].path.end

    def waiting(self, time_s: float) -> int:
        """How many of its moves have not begun at a time."""
        return len(self._geometry.moves) - 1 - self._place(time_s)

    def move_at(self, time_s: float) -> int:
        """The number of the move that is under way at a time."""
        return self._geometry.moves[self._place(time_s)].number

    def _place(self, time_s: float) -> int:
        targets = self._geometry.targets
        return min(bisect_right(targets, self._timing.position(time_s)), len(targets) - 1)

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad) at a time."""
        if time_s >= self.rest_s:
            return self.end
        x = self._timing.position(time_s)
        pieces = self._geometry.pieces
        k = len(pieces) - 1
        while k and pieces[k].start > x:
            k -= 1
        return pieces[k].curve.joints(x - pieces[k].origin)

    def joints_along(self, times: Array) -> list[Joints]:
        """The same at rising times (m,) before `rest_s`, for less where there are many."""
        x = self._timing.positions(times)
        pieces = self._geometry.pieces
        starts = [piece.start for piece in pieces]
        borders = x.searchsorted(starts).tolist()
        joints: list[Joints] = []
        for piece, first, last in zip(pieces, borders, [*borders[1:], len(x)], strict=True):
            if first < last:
                joints += piece.curve.joints_along(x[first:last] - piece.origin)
        return joints


def _bounds(move: Move) -> Bounds:
    return Bounds.of(move.path.samples.scaled(move.length_s), move.limits, move.limits.velocity)
