"""Random sequences of moves with blending, for any robot, and a recorder of their motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import RobotDescription, load_robot
from tests.blended_path import Joints, Run, SentMove
from tests.requests import joint_move, lin_joint_move, lin_move, ptp_move
from tests.samples import MANY
from tests.stepped import Array, SteppedRobot

KINDS = ("joint", "ptp", "ptpr", "lin", "linr", "lin joint")
PLACES = (
    *("near", "near", "shift", "shift", "shift", "far", "small", "tiny", "same", "turn", "back", "on"),
    "wrist",  # nearly stretched
)
"""Places of targets, relative to the end of the sequence; those listed twice are drawn more often."""
SCOUT_TICK_S = 0.05
REACH = 0.75  # of the position limits, for targets far away
NEAR = 0.12  # of the position limits, from the end of the sequence
LARGEST_SHIFT_MM, LARGEST_TURN_RAD = 250.0, 0.6
LEAST_FAR_SPEED = 0.3
SPEEDS = (1.0, 1.0, 0.7, 0.5, 0.3, 0.1)
UNTIL_STOPPED = -1  # instead of ticks to wait
LONGEST = 20 if MANY else 6  # moves of a sequence
ROOMY = {
    "lbr_iiwa_7_r800": (0.0, 0.5, 0.0, -1.3, 0.0, 1.2, 0.0),
    "kr_6_r900_sixx": (0.0, -1.5, 1.6, 0.0, 1.4, 0.0),
}
"""Joint positions with room around the TCP."""

Order = Callable[[Controller, bool], object]
"""Sends something to a controller; with True a move as it is, with False without blending."""


@dataclass(frozen=True)
class RandomMove:
    """A move relative to the end of the sequence; `parts` (-1..1) choose its target."""

    kind: str
    place: str
    parts: tuple[float, ...]
    speeds_rel: tuple[float, ...]
    blending_mm: float
    wait: int
    """Ticks before the next is sent, or UNTIL_STOPPED."""

    @property
    def speeds(self) -> tuple[float, ...]:
        """Relative speeds of the joints; a move to somewhere far is not slow."""
        least = LEAST_FAR_SPEED if self.place == "far" else 0.0
        return tuple(max(speed, least) for speed in self.speeds_rel)


@dataclass(frozen=True)
class Interruption:
    """Something between two moves, and the ticks before what follows is sent; a pause ends then."""

    what: Literal["stop", "override"]
    wait: int
    value: float = 0.0
    """Value of the override."""


RESUMED = 0.4  # after a pause


def random_moves(
    joint_count: int = 7, kinds: Sequence[str] = KINDS, at_once: bool = False
) -> st.SearchStrategy[RandomMove]:
    anywhere = st.integers(0, 2**32 - 1).map(lambda seed: _random_parts(seed, joint_count))
    along_axes = st.tuples(*[st.sampled_from([0.0, 0.0, -1.0, -0.5, 0.5, 1.0])] * joint_count)
    speeds = st.sampled_from([*SPEEDS, 0.05])
    radii = st.one_of(st.floats(0.0, 80.0), st.floats(5.0, 80.0), st.just(0.0), st.just(500.0))
    waits = st.one_of(st.just(0), st.just(0), st.integers(0, 400), st.just(UNTIL_STOPPED))
    return st.builds(
        RandomMove,
        st.sampled_from(kinds),
        st.sampled_from(PLACES),
        st.one_of(anywhere, anywhere, along_axes),
        st.one_of(speeds.map(lambda speed: (speed,) * joint_count), st.tuples(*[speeds] * joint_count)),
        radii,
        st.just(0) if at_once else waits,
    )


def sequences(
    joint_count: int = 7,
    kinds: Sequence[str] = KINDS,
    at_once: bool = False,
    stops: bool = False,
    overrides: bool = False,
    longest: int = LONGEST,
) -> st.SearchStrategy[list[Any]]:
    """2 to `longest` moves, with what is asked for between them."""
    item: st.SearchStrategy[Any] = random_moves(joint_count, kinds, at_once)
    if stops:
        item = st.one_of(item, item, item, st.builds(Interruption, st.just("stop"), st.integers(0, 80)))
    if overrides:
        values = st.one_of(st.floats(0.2, 1.0), st.sampled_from([0.0, 0.0, 1.0]))
        item = st.one_of(item, st.builds(Interruption, st.just("override"), st.integers(0, 500), values))
    return st.integers(2, longest).flatmap(lambda count: st.lists(item, min_size=count, max_size=count))


def in_the_open(name: str, tick_s: float = 0.002) -> Recorder:
    """Return a robot with room for a square in front of it."""
    return Recorder(replace(load_robot(name), home=ROOMY[name]), tick_s)


class Recorder:
    """A robot that runs a sequence, and a scout that runs ahead.

    The scout runs each move alone, without blending, and rests at its target. The next move starts there,
    wherever the robot is.
    """

    def __init__(self, description: RobotDescription, tick_s: float = 0.002) -> None:
        self.robot = SteppedRobot(description, tick_s)
        self.scout = SteppedRobot(description, SCOUT_TICK_S)
        self.runs = [Run(self.robot, 0, self.robot.controller.joints, [])]
        self._orders: list[tuple[int, Order]] = []

    @property
    def tick(self) -> int:
        return len(self.robot.joints) - 1

    @property
    def end(self) -> Joints:
        """Joints at the end of the moves that were sent."""
        return self.scout.controller.joints

    def send(self, kind: str, joints: Joints, frame: Frame, speeds: Joints, blending_mm: float) -> bool:
        """Send a move; return True if it was accepted. Joints and frame are the same target."""
        order = _order(kind, joints, frame, speeds, blending_mm)
        start = self.end
        scouted = _accepted(order, self.scout.controller, False)
        accepted = _accepted(order, self.robot.controller, True)
        assert accepted == scouted, "what is accepted may depend neither on blending nor on what runs"
        if accepted:
            self.scout.runs_until_stopped()
            self._orders.append((self.tick, order))
            speeds_rel = speeds if kind == "joint" else speeds[:1] * len(speeds)
            self.runs[-1].moves.append(SentMove(kind, start, self.end, speeds_rel, blending_mm, self.tick))
        return accepted

    def send_move(self, move: RandomMove) -> None:
        """Send a move of a random sequence."""
        moves = self.runs[-1].moves
        last = (moves[-1].start, moves[-1].corner) if moves else (self.end, self.end)
        self.send(move.kind, *aimed(move, self.robot, self.end, last), move.speeds, move.blending_mm)

    def lin(self, x_mm: float, y_mm: float, z_mm: float, blending_mm: float, speed_rel: float = 1.0) -> None:
        """Send a LIN relative to the end of the sequence, which has to be accepted."""
        frame = self.scout.controller.tool_frame()
        target = Frame(*np.add(frame, (x_mm, y_mm, z_mm, 0.0, 0.0, 0.0)).tolist())
        assert self.send("lin", self.end, target, (speed_rel,) * len(self.end), blending_mm)

    def stop(self) -> None:
        """Stop the robot; its waiting moves are dropped here, too."""
        run = self.runs[-1]
        if self.tick <= run.first:  # still stopping, or at rest: nothing has begun
            run.moves.clear()
        else:
            twin = self._twin()
            twin.stop()
            twin.runs_until_stopped()
            run.stopped_at, run.last = self.tick, len(twin.joints) - 1
            self.runs.append(Run(self.robot, run.last, twin.controller.joints, []))
        self.scout.goes_to(self.runs[-1].start)
        self.robot.stop()
        self._orders.append((self.tick, lambda controller, _: controller.stop()))

    def override(self, value: float) -> None:
        """Set the override of the robot; the scout stays at full speed."""
        self.robot.controller.set_override(value)
        self._orders.append((self.tick, lambda controller, _: controller.set_override(value)))

    def wait(self, ticks: int) -> None:
        if ticks == UNTIL_STOPPED:
            self.robot.runs_until_stopped()
        else:
            self.robot.step(ticks)

    def finish(self) -> None:
        """Wait for the end of the sequence."""
        self.robot.runs_until_stopped()
        self.robot.step(3)
        self.runs[-1].last = self.tick
        self.runs = [run for run in self.runs if run.moves]

    def run(self, sequence: list[Any]) -> None:
        """Send a sequence at its ticks, and wait for the end."""
        for item in sequence:
            if isinstance(item, RandomMove):
                self.send_move(item)
            elif item.what == "override":
                self.override(item.value)
                if item.value == 0.0:
                    self.wait(item.wait)
                    self.override(RESUMED)
            else:
                self.stop()
            self.wait(item.wait)
        self.finish()

    def ticks(self, blending: bool = True) -> int:
        """Return ticks until rest for the sequence sent at the same ticks, with or without blending."""
        return len(self._twin(blending, to_end=True).joints) - 1

    def _twin(self, blending: bool = True, to_end: bool = False) -> SteppedRobot:
        """Another robot to which the same was sent at the same ticks."""
        twin = SteppedRobot(self.robot.description, self.robot.tick_s)
        for tick, order in self._orders:
            twin.step(tick + 1 - len(twin.joints))
            order(twin.controller, blending)
        if to_end:
            twin.runs_until_stopped()
        else:
            twin.step(self.tick + 1 - len(twin.joints))
        return twin


def aimed(
    move: RandomMove, robot: SteppedRobot, end: Joints, last: tuple[Joints, Joints]
) -> tuple[Joints, Frame]:
    """Return joints and frame of a target, relative to the end of the sequence and to the last move.

    Where the frame is shifted, the joints are only near.
    """
    d, here = robot.description, robot.tcp_frame(end)
    parts, at = np.array(move.parts), np.array(end)
    centre = 0.5 * np.add(d.position_min, d.position_max)
    reach = 0.5 * np.subtract(d.position_max, d.position_min)
    before = robot.tcp_frame(last[0])
    toward: dict[str, Any] = {
        "near": at + NEAR * reach * parts,
        "far": at + NEAR * reach * parts if move.kind.startswith("lin") else centre + REACH * reach * parts,
        "shift": at + 0.5 * NEAR * reach * parts,
        "small": at + 2e-3 * parts,
        "tiny": at + 10.0 ** (-9.0 + 6.0 * abs(parts[0])) * parts,
        "same": end,
        "wrist": _with_wrist(
            at + 0.5 * NEAR * reach * parts, 10.0 ** (-9.0 + 8.0 * abs(parts[0])) * parts[1]
        ),
        "turn": at + np.append(np.zeros(len(end) - 1), parts[-1]),
        "back": last[0],
        "on": at + 0.5 * np.subtract(last[1], last[0]),
    }
    joints = tuple(np.clip(toward[move.place], centre - 0.97 * reach, centre + 0.97 * reach).tolist())
    shift = np.concatenate([LARGEST_SHIFT_MM * parts[:3], LARGEST_TURN_RAD * parts[3:6]])
    shifts = {
        "shift": shift,
        "turn": [0.0, 0.0, 0.0, *shift[3:6]],
        "small": 0.01 * shift,
        "on": [*(0.5 * np.subtract(here[:3], before[:3])), 0.0, 0.0, 0.0],
    }
    if move.place in shifts:
        return joints, Frame(*np.add(here, shifts[move.place]).tolist())
    return joints, robot.tcp_frame(joints)


def send(robot: SteppedRobot, item: RandomMove | Interruption) -> bool:
    """Send a move or a stop to a robot without a recorder; return True if it was accepted."""
    if isinstance(item, Interruption):
        robot.stop()
        return True
    end = robot.controller.end_of_queue
    target = aimed(item, robot, end, (robot.controller.joints, end))
    return _accepted(_order(item.kind, *target, item.speeds, item.blending_mm), robot.controller, True)


def _with_wrist(joints: Array, angle: float) -> Array:
    """Return the joints with their wrist at that angle (rad)."""
    joints[-2] = angle
    return joints


def _random_parts(seed: int, count: int) -> tuple[float, ...]:
    return tuple(np.random.default_rng(seed).uniform(-1.0, 1.0, count).tolist())


def _order(kind: str, joints: Joints, frame: Frame, speeds: Joints, blending_mm: float) -> Order:
    speed, a3 = speeds[0], joints[2]
    orders: dict[str, Order] = {
        "joint": lambda c, _: c.move(joint_move(joints, speeds)),
        "ptp": lambda c, blend: c.move(ptp_move(frame, speed, blending_mm * blend)),
        "ptpr": lambda c, blend: c.move(ptp_move(frame, speed, blending_mm * blend, a3)),
        "lin": lambda c, blend: c.move(lin_move(frame, speed, blending_mm * blend)),
        "linr": lambda c, blend: c.move(lin_move(frame, speed, blending_mm * blend, a3)),
        "lin joint": lambda c, blend: c.move(lin_joint_move(joints, speed, blending_mm * blend)),
    }
    return orders[kind]


def _accepted(order: Order, controller: Controller, blending: bool) -> bool:
    try:
        order(controller, blending)
    except Refused:
        return False
    return True
