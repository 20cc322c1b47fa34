"""How long blended chains take, over the time-optimum of the same path and over the chain without blending.

And what planning them costs. The path is taken from where the robot was at its ticks, so that the
time-optimum is that of the path with its blends, whatever their shape.
"""

import gc
from collections.abc import Callable
from statistics import median
from time import thread_time
from typing import NamedTuple

import numpy as np

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.lines import LARGEST_TURN_RAD, random_joints
from benchmarks.time_optimal import Array, fastest_along_s
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame, compose
from iiwa_sim.motion.differences import derivatives
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.model import Model

CHAINS = 30
MOVES = (2, 20)
RADII_MM = (5.0, 80.0)
SPEEDS_REL = (0.1, 1.0)
LENGTHS_MM = (100.0, 500.0)
TICK_S = 0.001
STENCIL = 5
STEP_RAD, STEP_IN_BLEND_RAD = 2e-3, 3e-4  # between samples of the path, of all joints together
LONG_CHAIN = 1000
LONG_CHAIN_TICK_S = 0.002
REPEATS = 3

Command = Callable[[Controller, bool], int]
"""Sends a move, with its blending or without, and gives its number."""


class Move(NamedTuple):
    """A move of a chain."""

    send: Command
    speed_rel: float
    radius_mm: float


class Recording(NamedTuple):
    """What a controller did with a chain."""

    joints: Array
    """At each tick (m, n), from rest to rest."""
    ends: list[int]
    """For each move the tick at which it was done."""

    @property
    def duration_s(self) -> float:
        """Of all ticks."""
        return (len(self.joints) - 1) * TICK_S


def measure() -> list[Figure]:
    """Chains of LIN, of PTP, and of both, of the default robot."""
    description = load_robot()
    figures = []
    for seed, kinds in enumerate((("LIN",), ("PTP",), ("LIN", "PTP"))):
        name = kinds[0] if len(kinds) == 1 else "mixed"
        to_optimum, to_exact = [], []
        rng = np.random.default_rng(seed)
        for _ in range(CHAINS):
            chain = random_chain(description, rng, kinds, int(rng.integers(MOVES[0], MOVES[1] + 1)))
            blended, exact = run(description, chain, True), run(description, chain, False)
            optimum_s = time_optimum_s(description, chain, blended, exact)
            to_optimum.append(blended.duration_s / optimum_s)
            to_exact.append(blended.duration_s / exact.duration_s)
        of = f"{name} chain duration"
        figures += [
            Figure(
                f"{of} over time-optimal, median",
                percentile(to_optimum, 0.5),
                "x",
                at_most=1.25,
                kind=Kind.SIMULATED,
            ),
            Figure(
                f"{of} over time-optimal, p95",
                percentile(to_optimum, 0.95),
                "x",
                at_most=1.35,
                kind=Kind.SIMULATED,
            ),
            Figure(f"{of}, blended over not, median", percentile(to_exact, 0.5), "x"),
            Figure(f"{of}, blended over not, largest", max(to_exact), "x", at_most=1.0, kind=Kind.SIMULATED),
        ]
    return figures + _planning(description)


def random_chain(
    description: RobotDescription, rng: np.random.Generator, kinds: tuple[str, ...], count: int
) -> list[Move]:
    """Moves that the robot accepts one after the other from home: PTP to anywhere, LIN as in `lines`."""
    scout = Controller(description, tick_s=1.0)
    model = Model(description)
    chain: list[Move] = []
    while len(chain) < count:
        radius_mm, speed_rel = float(rng.uniform(*RADII_MM)), float(rng.uniform(*SPEEDS_REL))
        lin = kinds[rng.integers(len(kinds))] == "LIN"
        if lin:
            way, turn = rng.normal(size=3), rng.normal(size=3)
            way *= rng.uniform(*LENGTHS_MM) / np.linalg.norm(way)
            turn *= rng.uniform(0.0, LARGEST_TURN_RAD) / np.linalg.norm(turn)
            target = Frame(*np.add(scout.tool_frame(), (*way, *turn)).tolist())
        else:
            flange = model.flange(random_joints(description, rng))
            target = Frame.from_transform(compose(flange, description.tool_in_flange))
        move = Move(_command(lin, target, speed_rel, radius_mm), speed_rel, radius_mm)
        try:
            move.send(scout, False)
        except Refused:
            continue
        while scout.moving:
            scout.step()
        chain.append(move)
    return chain


def run(description: RobotDescription, chain: list[Move], blending: bool) -> Recording:
    """All moves sent at once."""
    controller = Controller(description, TICK_S)
    numbers = [move.send(controller, blending) for move in chain]
    joints = [controller.joints]
    ends: list[int] = []
    while controller.moving:
        controller.step()
        joints.append(controller.joints)
        while len(ends) < len(numbers) and not controller.is_pending(numbers[len(ends)]):
            ends.append(len(joints) - 1)
    return Recording(np.array(joints), ends)


def time_optimum_s(
    description: RobotDescription, chain: list[Move], blended: Recording, exact: Recording
) -> float:
    """The fastest run of the path that the robot took, without jerk limits.

    Each move keeps its relative speed, within the radius of a corner the larger of two. The exact recording
    tells where the corners are.
    """
    model = Model(description)
    q = blended.joints
    places = np.array(
        [compose(model.flange(row), description.tool_in_flange).translation for row in q.tolist()]
    )
    number = np.searchsorted(blended.ends, np.arange(len(q)), side="right").clip(0, len(chain) - 1)
    speeds = np.array([move.speed_rel for move in chain])
    speed, in_blend = speeds[number], np.zeros(len(q), bool)
    for i, move in enumerate(chain[:-1]):
        flange = model.flange(exact.joints[exact.ends[i]].tolist())
        corner = compose(flange, description.tool_in_flange).translation
        near = (np.linalg.norm(places - corner, axis=1) <= move.radius_mm / 1000.0) & (number - i <= 1)
        near &= number >= i
        in_blend |= near
        speed[near] = np.maximum(speed[near], max(speeds[i], speeds[i + 1]))
    kept = _apart(q, np.where(in_blend, STEP_IN_BLEND_RAD, STEP_RAD))
    q = q[kept]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    dq, ddq, _ = derivatives(s, q, STENCIL)
    velocity = speed[kept][:, None] * description.velocity
    return fastest_along_s(s, dq, ddq, velocity, np.array(description.acceleration))


def _apart(q: Array, steps: Array) -> list[int]:
    """Ticks from the first to the last one between which the joints go at least a step."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))]).tolist()
    last = len(q) - 1
    kept = [0]
    for k, (place, step) in enumerate(zip(along, steps.tolist(), strict=True)):
        if place - along[kept[-1]] >= step and along[last] - place >= step:
            kept.append(k)
    return [*kept, last]


class Costs(NamedTuple):
    """Microseconds of computing that it took to accept each move, and for each tick."""

    accepting: list[float]
    ticks: list[float]


def _planning(description: RobotDescription) -> list[Figure]:
    """What a thousand mixed moves cost that are queued at once.

    The timing is planned, and positions are found ahead, in some ticks; the others are all alike.
    """
    runs = [_long_chain(description, LONG_CHAIN_TICK_S) for _ in range(REPEATS)]
    ticks = [min(of_tick) for of_tick in zip(*(costs.ticks for costs in runs), strict=True)]
    accepting = [min(of_move) for of_move in zip(*(costs.accepting for costs in runs), strict=True)]
    tick_us = median(ticks)
    in_ticks = (sum(ticks) - len(ticks) * tick_us) / LONG_CHAIN
    of = f"chain of {LONG_CHAIN} mixed moves"
    return [
        Figure(
            f"{of}: planning, mean per move",
            in_ticks + sum(accepting) / LONG_CHAIN,
            "us",
            at_most=500,
            kind=Kind.CPU,
            margin=10,  # missed: some 3,100
        ),
        Figure(f"{of}: planning while it runs, mean per move", in_ticks, "us"),
        Figure(f"{of}: accepting a move, p50", percentile(accepting, 0.5), "us"),
        Figure(f"{of}: accepting a move, p95", percentile(accepting, 0.95), "us"),
        Figure(f"{of}: accepting one of the last 100, p95", percentile(accepting[-100:], 0.95), "us"),
        Figure(f"{of}: accepting a move, largest", max(accepting), "us"),
        Figure(f"{of}: a tick without planning", tick_us, "us"),
        Figure(f"{of}: a tick, largest", max(ticks), "us"),
    ]


def _long_chain(description: RobotDescription, tick_s: float) -> Costs:
    """Queued at once, and run to its end."""
    rng = np.random.default_rng(4)
    controller = Controller(description, tick_s)
    centre, home = controller.tool_frame(), controller.joints
    costs = Costs([], [])
    gc.collect()
    gc.disable()
    try:
        for _ in range(LONG_CHAIN):
            send = _in_a_box(rng, centre, home)
            began = thread_time()
            send(controller, True)
            costs.accepting.append(1e6 * (thread_time() - began))
        while controller.moving:
            began = thread_time()
            controller.step()
            costs.ticks.append(1e6 * (thread_time() - began))
    finally:
        gc.enable()
    return costs


def _in_a_box(rng: np.random.Generator, centre: Frame, home: tuple[float, ...]) -> Command:
    """A move to a place within 150 mm in x and z, 200 mm in y, of the centre, at any speed and blending."""
    radius_mm, speed_rel = float(rng.uniform(*RADII_MM)), float(rng.uniform(*SPEEDS_REL))
    kind = int(rng.integers(3))
    if kind == 0:
        joints = np.add(home, rng.uniform(-0.2, 0.2, len(home))).tolist()
        return lambda controller, _: controller.joint_move(joints, [speed_rel] * len(joints))
    low, high = (-150.0, -200.0, -150.0), (50.0, 200.0, 50.0)
    shift = (*rng.uniform(low, high), *rng.uniform(-0.3, 0.3, 3))
    return _command(kind == 1, Frame(*np.add(centre, shift).tolist()), speed_rel, radius_mm)


def _command(lin: bool, target: Frame, speed_rel: float, radius_mm: float) -> Command:
    def send(controller: Controller, blending: bool) -> int:
        move = controller.lin_move if lin else controller.ptp_move
        return move(target, speed_rel, radius_mm if blending else 0.0)

    return send
