"""A chain: moves that are driven on into each other without a stop, from rest to rest.

Its parameter x joins their paths and the blends between them. Each path counts as long as its joints take at
the least at the speed of its move, so that x goes about as fast as time.
"""

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from iiwa_sim.motion.bounds import Bounds, joined
from iiwa_sim.motion.chain_timing import from_rest, going_on
from iiwa_sim.motion.corner import Corner, rounded, window_of
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints, Path
from iiwa_sim.motion.smooth import SmoothTiming

GENTLE = 1.5  # windows of the moving average, during which a chain sets out or comes to rest with a share


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

    steady: bool
    """Whether no corner slows the robot down much."""
    moves: list[Move]
    targets: list[float]
    """The x of the target of each move: that of a corner is inside its blend."""
    pieces: list[_Piece]
    bounds: Bounds

    @classmethod
    def of(cls, move: Move) -> "_Geometry":
        piece = _Piece(0.0, 0.0, _Lengthened(move.path, move.length_s))
        return cls(True, [move], [move.length_s], [piece], _bounds(move))

    def gone_on(self, move: Move, corner: Corner) -> "_Geometry":
        """With another move blended into the last one."""
        target = self.targets[-1]
        blend = corner.blend
        start = target - corner.before
        over_blend = corner.bounds.moved(start)
        end = float(over_blend.s[-1])
        on_path = _bounds(move).moved(target)
        return _Geometry(
            self.steady and corner.steady,
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
        return _Geometry(True, moves, targets, self.pieces[first:], self.bounds.starting(x))


class Plan(NamedTuple):
    """Where a chain goes, and when."""

    timing: SmoothTiming
    geometry: _Geometry


class Chain:
    """At rest at the start of its first move at time 0, and at rest at the target of its last."""

    def __init__(
        self,
        move: Move,
        waiting: Sequence[Move],
        lowest: Array,
        highest: Array,
        share: float = 1.0,
    ) -> None:
        """Of a move and as many of those that wait as it can be driven on into round steady corners.

        The limits of joint positions are in rad (n,). `share` is the part of the acceleration limits with
        which it sets out.
        """
        self._position_limits = lowest, highest
        self.open = True
        """Whether another move may still blend into the last one."""
        stages = self._stages(_Geometry.of(move), waiting, 0.0)
        window_s, bounds = window_of(move.limits), stages[-1].bounds
        if share < 1.0:
            bounds = bounds.gentler(0.0, _gentle_way(bounds, 0, window_s, move, share), share)
        timing, bounds = from_rest(bounds, window_s)
        self.plan = Plan(timing, stages[-1]._replace(bounds=bounds))
        self.taken = len(stages)
        """How many moves it has begun with."""

    def driven_on(self, waiting: Sequence[Move], now_s: float, time_s: float) -> Plan | None:
        """A plan with more moves, changing nothing before a time: with those after it that come after steady
        corners, or with one.

        None where there is none. Where the robot is already in the corner, or there is none to round, the
        chain is no longer open.
        """
        if not self.open:
            return None
        left = self.plan.geometry.left(self.plan.timing.position(now_s))
        stages = self._stages(left, waiting, self.plan.timing.front(time_s)[0], first_steady=False)
        for count in sorted({len(stages) - 1, 1}, reverse=True):
            if 0 < count < len(stages):
                planned = going_on(self.plan.timing, stages[count].bounds, now_s, time_s)
                if planned is not None:
                    return Plan(planned[0], stages[count]._replace(bounds=planned[1]))
        return None

    def brake_with(self, share: float, now_s: float, time_s: float) -> None:
        """Come to rest with a part of the acceleration limits, if that is possible without changing anything
        before a time."""
        geometry = self.plan.geometry.left(self.plan.timing.position(now_s))
        bounds, end = geometry.bounds, geometry.targets[-1]
        way = _gentle_way(bounds, -1, self.plan.timing.window_s, self.moves[-1], share)
        start = end - way
        if share < 1.0 and start > max(float(bounds.s[0]), self.plan.timing.front(time_s)[0]):
            planned = going_on(self.plan.timing, bounds.gentler(start, end, share), now_s, time_s)
            if planned is not None:
                self.plan = Plan(planned[0], geometry._replace(bounds=planned[1]))

    def _stages(
        self, geometry: _Geometry, moves: Sequence[Move], front: float, *, first_steady: bool = True
    ) -> list[_Geometry]:
        """A geometry with 0, 1, ... more moves, as far as there are corners ahead of the front to round.

        All of them are steady, or one that may not be is the only one.
        """
        stages = [geometry]
        for move in moves:
            corner = rounded(geometry.moves[-1], move, *self._position_limits)
            if corner is None or geometry.targets[-1] - corner.before <= front:
                self.open = self.open and len(stages) > 1
                break
            if not corner.steady and (first_steady or len(stages) > 1):
                break
            geometry = geometry.gone_on(move, corner)
            stages.append(geometry)
            if not corner.steady:
                break
        return stages

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

    def joints_along(self, times: Array) -> list[Joints]:
        """The same at rising times (m,) before `rest_s`, for less where there are many."""
        x = self.plan.timing.positions(times)
        pieces = self.plan.geometry.pieces
        starts = [piece.start for piece in pieces]
        borders = x.searchsorted(starts).tolist()
        borders[0] = 0
        joints: list[Joints] = []
        for piece, first, last in zip(pieces, borders, [*borders[1:], len(x)], strict=True):
            if first < last:
                joints += piece.curve.joints_along(x[first:last] - piece.origin)
        return joints


def _gentle_way(bounds: Bounds, end: int, window_s: float, move: Move, share: float) -> float:
    """How far the robot goes while it sets out or comes to rest gently, at an end (0 or -1) of the bounds."""
    way = 0.5 * share * float(bounds.room[:, end].min()) * (GENTLE * window_s) ** 2
    return min(way, 0.5 * move.length_s)


def _bounds(move: Move) -> Bounds:
    return Bounds.of(move.path.samples.scaled(move.length_s), move.limits, move.limits.velocity)
