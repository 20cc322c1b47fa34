"""Duration of blended chains, relative to the time-optimum of the path and to the chain without blending.

The path is that of the robot at its ticks, so the time-optimum includes the blends, whatever their shape.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.lines import LARGEST_TURN_RAD, random_joints
from benchmarks.time_optimal import Array, apart, derivatives, fastest_along_s
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import Kind as How
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame, compose
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.model import Model

CHAINS = 30
MOVES = (2, 20)
RADII_MM = (5.0, 80.0)
SPEEDS_REL = (0.1, 1.0)
LENGTHS_MM = (100.0, 500.0)
TICK_S = 0.001
STEP_RAD, STEP_IN_BLEND_RAD = 2e-3, 3e-4  # step between samples of the path, of all joints together

Command = Callable[[Controller, bool], int]
"""Sends a move, with or without its blending, and returns its number."""


class Move(NamedTuple):
    """A move of a chain."""

    send: Command
    speed_rel: float
    radius_mm: float


class Recording(NamedTuple):
    """The motion of a controller along a chain."""

    joints: Array
    """Joints at each tick (m, n), from rest to rest."""
    ends: list[int]
    """For each move the tick at which it ended."""

    @property
    def duration_s(self) -> float:
        """Duration of all ticks."""
        return (len(self.joints) - 1) * TICK_S


def measure() -> list[Figure]:
    """Measure chains of LIN, of PTP, and of both, for the default robot."""
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
    return figures


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
    """Run a chain whose moves are all sent at once."""
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
    """Shortest duration of the path of a recording, without jerk limits.

    Each move keeps its relative speed; within the radius of a corner the larger of two counts. `exact`, the
    recording without blending, tells where the corners are.
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
    kept = apart(q, np.where(in_blend, STEP_IN_BLEND_RAD, STEP_RAD))
    q = q[kept]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    dq, ddq = derivatives(s, q)
    velocity = speed[kept][:, None] * description.velocity
    return fastest_along_s(s, dq, ddq, velocity, np.array(description.acceleration))


def _command(lin: bool, target: Frame, speed_rel: float, radius_mm: float) -> Command:
    def send(controller: Controller, blending: bool) -> int:
        kind = How.LIN if lin else How.PTP
        return controller.move(MoveRequest(kind, target, speed_rel, radius_mm if blending else 0.0))

    return send
