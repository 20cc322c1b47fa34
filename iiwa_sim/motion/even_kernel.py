"""Ticks in which planned time goes on evenly, to joint positions that are known: nearly all there are.

What begins, changes and ends such ticks is up to heirs in Python: the override, planned time, the drive, the
motions of a robot.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections import deque
from typing import Any

import cython

from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.feeling_kernel import Reached


@cython.cclass
class Pace:
    """The rate of planned time, and how much of that passes in a tick."""

    tick_s: float = cython.declare(cython.double, visibility="public")
    rate: float = cython.declare(cython.double, visibility="public")
    """At the end of the last tick."""
    slope_per_s: float = cython.declare(cython.double, visibility="public")
    """Derivative of the rate at the end of the last tick."""
    advance_s: float = cython.declare(cython.double, visibility="public")
    """Planned time that has passed in the last tick."""
    even: bool = cython.declare(cython.bint, visibility="public")
    """Whether the rate was constant throughout the last tick, and no other value has been requested since."""
    level: bool = cython.declare(cython.bint, visibility="public")
    """Whether a tick changes nothing of this: so until another value is requested."""


@cython.cclass
class EvenTime:
    """Planned time of one motion, which goes on at a pace until a stop slows it down."""

    time_s: float = cython.declare(cython.double, visibility="public")
    _pace: Pace
    _slowing: Any = cython.declare(object, visibility="public")  # how it does so for a stop

    def __init__(self, pace: Pace) -> None:
        """The time begins at 0; the owner of the pace steps that before this."""
        self._pace = pace
        self.time_s = 0.0
        self._slowing = None

    @property
    def even(self) -> bool:
        """Whether the rate is constant throughout this tick, and stays so without another request."""
        return self._slowing is None and self._pace.even

    @property
    def stopping(self) -> bool:
        """Whether the rate is decreasing to 0 for a stop, or has reached it."""
        return self._slowing is not None

    @cython.ccall
    @cython.exceptval(-1)
    def step_evenly(self) -> cython.bint:
        """Make one tick if the rate is constant and not 0 throughout it; otherwise returns False."""
        if self._slowing is not None or not self._pace.even or self._pace.advance_s == 0.0:
            return False
        self.time_s += self._pace.advance_s
        return True


@cython.cclass
class EvenTicks:
    """Joint positions over ticks, some of which are known ahead."""

    joints: Joints = cython.declare(object, visibility="public")
    """Where the robot is (rad)."""
    _time: EvenTime = cython.declare(EvenTime, visibility="public")
    _ahead: list[Joints] = cython.declare(list, visibility="public")  # of coming ticks, the last one first
    _quiet_until_s: float = cython.declare(cython.double, visibility="public")
    # of planned time: until then there is nothing to look ahead for
    _chain: Any = cython.declare(object, visibility="public")  # under way; None at rest
    _last: int = cython.declare(cython.int, visibility="public")
    # number of the move under way, once it is the last one of the chain; 0 before
    _planned: deque[Any] = cython.declare(object, visibility="public")  # moves that wait
    _again: deque[Any] = cython.declare(object, visibility="public")  # those to be planned again before

    @property
    def moving(self) -> bool:
        """Whether a move runs, is being stopped, or waits."""
        return self._chain is not None or bool(self._planned) or bool(self._again)

    @property
    def under_way(self) -> int:
        """The number of the move that runs and is not being stopped, 0 where there is none."""
        if self._chain is None or self._time._slowing is not None:
            return 0
        if self._last == 0:
            move, moves = self._chain.move_at(self._time.time_s), self._chain.moves
            if move is not moves[len(moves) - 1]:
                number: int = move.number
                return number
            self._last = move.number
        return self._last

    @property
    def coming(self) -> Joints:
        """Where the next tick brings the robot (rad), if nothing is asked for until then."""
        time: Any = self._time
        if len(self._ahead) > 0 and time.even:
            return self._ahead[len(self._ahead) - 1]
        return self.joints if self._chain is None else self._chain.joints(time.coming_s)

    @cython.ccall
    @cython.exceptval(-1)
    def step_evenly(self) -> cython.bint:
        """Make one tick if all it takes is to go on to joint positions that are known; otherwise returns
        False."""
        if (
            len(self._ahead) > 0
            and self._time.time_s < self._quiet_until_s
            and not self._again
            and self._time.step_evenly()
        ):
            self.joints = self._ahead.pop()
            return True
        return False


@cython.cclass
class GivesWay:
    """Whether a robot is where its nominal motion is, or gives way around that."""

    active: bool = cython.declare(cython.bint, visibility="public")
    """Whether the robot yields or brakes, and is not where the nominal motion is but elsewhere."""
    tcp_contact: Reached | None = cython.declare(object, visibility="public")
    """Where the TCP has come to in the last tick, and what it touches there; None where that is not known."""


@cython.cclass
class Made:
    """What makes the nominal motion of a robot."""

    active: Any = cython.declare(object, visibility="public")
    """What moves the robot, or has moved it last; stiff, it alone is stepped."""
    _pursuit: Any = cython.declare(object, visibility="public")
    # what the servo is to do, once the drive is at rest; None for nothing


@cython.cclass
class EvenMotions:
    """The motions of one robot, in ticks in which all it takes is to go on: nearly all there are."""

    joints: Joints = cython.declare(object, visibility="public")
    """Joint positions (rad)."""
    drive: Any = cython.declare(EvenTicks, visibility="public")
    """Runs normal moves, the only ones that queue."""
    _override: Any = cython.declare(Pace, visibility="public")
    _nominal: Any = cython.declare(Made, visibility="public")
    _follower: Any = cython.declare(GivesWay, visibility="public")
    _next: Any = cython.declare(object, visibility="public")
    # what takes the place of the motion once that is at rest; None for nothing

    @property
    def moving(self) -> bool:
        """Whether anything moves, is being stopped, or waits."""
        # Asked for in every tick: first what it mostly is.
        if self.drive._chain is not None:
            return True
        active = self._nominal.active
        if active is self.drive and not self._follower.active:
            waits: bool = self._next is not None or self._nominal._pursuit is not None
            return waits or bool(self.drive.moving)
        return (active is not self.drive and bool(active.moving)) or bool(self.moves_otherwise())

    def moves_otherwise(self) -> bool:
        """Whether anything does, with no chain in the drive."""
        raise NotImplementedError

    @property
    def ends_by_itself(self) -> bool:
        """Whether anything moves and stops without a command: not in a pause, nor in a hold or before one."""
        # Asked for in every tick of a fast clock: first what it mostly is.
        return (
            self.moving
            and (self._override.rate != 0.0 or not self._override.pausing)
            and (self._next is None or not self.holds_next)
            and not self._follower.holding
        )

    @property
    def holds_next(self) -> bool:
        """Whether a gravity hold begins when the robot is at rest."""
        raise NotImplementedError

    @property
    def under_way(self) -> int:
        """The number of the normal move that runs and is not being stopped, 0 where there is none."""
        if self._follower.active or self._nominal.active is not self.drive:
            return 0
        number: int = self.drive.under_way
        return number

    @property
    def tcp_contact(self) -> Reached | None:
        """Where the TCP has come to in the last tick, and what it touches there, if that is known."""
        contact: Reached | None = self._follower.tcp_contact
        return contact

    @property
    def coming(self) -> Joints | None:
        """Where the next tick brings the robot (rad) if nothing is asked for; None while it gives way."""
        return None if self._follower.active else self._nominal.active.coming

    def step(self) -> None:
        """One tick. Where what moves fails, the robot stops, and what it raised is raised."""
        if self._override.level and not self._follower.active:
            active = self._nominal.active
            if active is self.drive:
                if self.drive.step_evenly():
                    self.joints = self.drive.joints
                    return
                if self._next is None and self._nominal._pursuit is None and not self.drive.moving:
                    self.joints = self.drive.joints  # it may have been put elsewhere
                    return
            elif active.moving:
                try:
                    active.step()
                except Exception:
                    self.stop()
                    raise
                self.joints = active.joints
                return
        self.make_step()

    def stop(self) -> None:
        """Stop, and forget what waits."""
        raise NotImplementedError

    def make_step(self) -> None:
        """A tick of any kind."""
        raise NotImplementedError
