"""Pairs of moves with a blended corner: drawn at random, run, and with their paths as polynomials.

Input of `benchmarks.corner_optimum`. Of the simulator only the public behaviour is used.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from benchmarks.told import Joints, Told, run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

Array = NDArray[np.float64]

SEED = 5
RANDOM = 60
NAMED = ((5.0, 1.0), (20.0, 1.0), (60.0, 1.0), (100.0, 1.0), (60.0, 0.3), (100.0, 0.3))
"""Blending (mm) and relative speed of the corner of two lines of 200 mm at a right angle."""
KINDS = (("lin", "lin"), ("lin", "lin"), ("ptp", "ptp"), ("ptp", "ptp"), ("lin", "ptp"), ("ptp", "lin"))
LENGTHS_MM, TURNS_DEG, RADII_MM, SPEEDS_REL = (60.0, 400.0), (10.0, 170.0), (5.0, 150.0), (0.1, 1.0)
AROUND_RAD, TURN_RAD = 0.5, 0.3
GOLDEN = 0.6180339887  # the golden ratio: fractional parts of its multiples fill 0 to 1 evenly

TICK_S = 0.001
DEGREE = 24
NODES = 64
FIT_RAD = 1e-6
NEWTON_STEPS = 50
NEWTON_RAD = 1e-12
LARGEST_STEP_RAD = 0.2


class Corner(NamedTuple):
    """Two moves from joint positions (rad)."""

    name: str
    start: Joints
    moves: tuple[Told, Told]
    angle_deg: float


def corners(description: RobotDescription, start: Joints) -> list[Corner]:
    """The named corners, and random ones that the robot accepts."""
    rng = np.random.default_rng(SEED)
    controller = Controller(description, TICK_S, start=start)
    here = controller.tool_frame()
    aside = here._replace(y_mm=here.y_mm + 200.0)
    below = aside._replace(z_mm=aside.z_mm - 200.0)
    found = [
        Corner(
            f"named R{radius:g} v{speed:g}",
            start,
            (Told("lin", aside, speed, radius), Told("lin", below, speed)),
            90.0,
        )
        for radius, speed in NAMED
    ]
    number = 0
    while number < RANDOM:
        corner = _random_corner(description, start, number, rng)
        if corner is not None:
            found.append(corner)
            number += 1
    return found


def _random_corner(
    description: RobotDescription, around: Joints, number: int, rng: np.random.Generator
) -> Corner | None:
    """Two moves of random kind, length and speed; None if the robot refuses them."""
    kinds = KINDS[number % len(KINDS)]
    start = tuple((np.array(around) + rng.uniform(-AROUND_RAD, AROUND_RAD, len(around))).tolist())
    angle = np.radians(TURNS_DEG[0] + (TURNS_DEG[1] - TURNS_DEG[0]) * ((GOLDEN * number) % 1.0))
    first, aside = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    second = np.cos(angle) * first + np.sin(angle) * aside
    radius_mm = float(np.exp(rng.uniform(*np.log(RADII_MM))))
    speeds = rng.uniform(*SPEEDS_REL, 2) if number % 3 else np.ones(2)
    lengths, turns = rng.uniform(*LENGTHS_MM, 2), rng.uniform(-TURN_RAD, TURN_RAD, (2, 3))
    try:
        controller = Controller(description, TICK_S)
        controller.place(start)
        target = controller.tool_frame()
        moves = []
        for kind, way, length, turn, speed, radius in zip(
            kinds, (first, second), lengths, turns, speeds, (radius_mm, 0.0), strict=True
        ):
            target = Frame(*np.add(target, (*(length * way), *turn)).tolist())
            moves.append(Told(kind, target, float(speed), radius))
            moves[-1].to(controller)
    except Refused:
        return None
    name = f"c{number:02d} {kinds[0].upper()}-{kinds[1].upper()}"
    return Corner(name, start, (moves[0], moves[1]), float(np.degrees(angle)))


class Recorded(NamedTuple):
    """The motion of the simulator: joints at every tick, blended, and with an exact stop."""

    blended: Array
    exact: Array
    corner: Joints
    end: Joints


def recorded(description: RobotDescription, corner: Corner) -> Recorded:
    """Run a corner both ways."""
    runs = []
    for blending in (True, False):
        controller = Controller(description, TICK_S)
        controller.place(corner.start)
        runs.append(run(controller, corner.moves, blending=blending))
    alone = Controller(description, TICK_S)
    alone.place(corner.start)
    at_corner = run(alone, corner.moves[:1])[-1]
    return Recorded(runs[0], runs[1], tuple(at_corner.tolist()), tuple(runs[1][-1].tolist()))


class Line:
    """The joints along a move, over s from 0 to 1."""

    def __init__(
        self, description: RobotDescription, kind: str, start: Joints, end: Joints, near: Array
    ) -> None:
        """`near` (m, n) are joints close to the path, in order."""
        self.description, self.model, self.straight = description, Model(description), kind == "lin"
        self.start, self.end = np.array(start), np.array(end)
        self.poses = [self._tcp(q) for q in (self.start, self.end)]
        x = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
        q = np.array([self.joints(s, near) for s in 0.5 * (x + 1.0)])
        self.coefficients = chebyshev.chebfit(x, q, DEGREE)
        error = float(np.abs(chebyshev.chebval(x, self.coefficients).T - q).max())
        if error > FIT_RAD:
            raise ArithmeticError(f"a line that no polynomial of degree {DEGREE} follows: {error:g} rad")

    def joints(self, s: float, near: Array) -> Array:
        """Joint positions (rad) at s: by Newton's method from those nearby whose TCP is closest."""
        if not self.straight:
            return self.start + s * (self.end - self.start)
        wanted = _between(self.poses[0], self.poses[1], s)
        gaps = np.linalg.norm(near - (self.start + s * (self.end - self.start)), axis=1)
        q = near[int(gaps.argmin())].copy()
        for _ in range(NEWTON_STEPS):
            pose = self._tcp(q)
            off = pin.log3(_rotation(wanted) @ _rotation(pose).T)
            error = [*np.subtract(wanted.translation, pose.translation), *off]
            rows = self._jacobian(q, pose)
            if len(q) > len(rows):
                rows = np.vstack([rows, np.eye(len(q))[2]])
                error.append(self.start[2] + s * (self.end[2] - self.start[2]) - q[2])
            step = np.linalg.solve(rows, error)
            q += step * min(1.0, LARGEST_STEP_RAD / max(float(np.abs(step).max()), NEWTON_RAD))
            if np.abs(step).max() < NEWTON_RAD:
                return q
        raise ArithmeticError(f"no joints at {s:.3f} of a line")

    def value(self, s: float) -> Array:
        """Joint positions (rad) at s, by the polynomial."""
        value: Array = chebyshev.chebval(2.0 * s - 1.0, self.coefficients)
        return value

    def place(self, q: Array) -> Array:
        """The parameter s (m,) of joints (m, n) on the move."""
        if not self.straight:
            way = self.end - self.start
            return (q - self.start) @ way / (way @ way)
        start, end = (np.array(pose.translation) for pose in self.poses)
        at = np.array([self._tcp(row).translation for row in q])
        return (at - start) @ (end - start) / ((end - start) @ (end - start))

    def _tcp(self, q: Sequence[float]) -> Transform:
        return compose(self.model.flange(q), self.description.tool_in_flange)

    def _jacobian(self, q: Array, tcp: Transform) -> Array:
        rows = self.model.jacobian(q)
        arm = np.subtract(tcp.translation, self.model.flange(q).translation)
        return np.vstack([rows[:3] + np.cross(rows[3:].T, arm).T, rows[3:]])


def _between(start: Transform, end: Transform, s: float) -> Transform:
    turn = pin.log3(_rotation(end) @ _rotation(start).T)
    rotation = pin.exp3(s * turn) @ _rotation(start)
    shift = np.subtract(end.translation, start.translation)
    return Transform(tuple(rotation.ravel().tolist()), tuple((start.translation + s * shift).tolist()))


def _rotation(pose: Transform) -> Array:
    return np.array(pose.rotation).reshape(3, 3)


def leaves(distances: list[float], parts: Array, radius: float) -> float:
    """The part of a move at which it first leaves a sphere round one of its ends."""
    outside = np.flatnonzero(np.array(distances) > radius)
    return float(parts[outside[0]]) if len(outside) else float(parts[-1])


def at(values: Array, at: Array) -> Array:
    """Rows of ticks, interpolated linearly between ticks."""
    ticks = np.arange(len(values))
    if values.ndim == 1:
        return np.interp(at, ticks, values)
    return np.stack([np.interp(at, ticks, column) for column in values.T], axis=1)
