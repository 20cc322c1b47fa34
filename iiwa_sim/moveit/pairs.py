"""Pairs of links that MoveIt need not compare, found by sampling the shapes of a URDF.

The kinds are those of MoveIt's setup assistant. Needs Pinocchio and Coal, which comes with it.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.fixed_poses import read_urdf

SAMPLES = 10_000
CLEARANCE_M = 0.02
"""Two links that come closer in any sample are compared: between samples they may come closer still."""
ADJACENT, ALWAYS, NEVER = "Adjacent", "Always", "Never"


class Pair(NamedTuple):
    """Two links, in the order of the URDF, and why nobody needs to compare them."""

    first: str
    second: str
    reason: str


def disabled_pairs(robot: RobotDescription, samples: int = SAMPLES) -> list[Pair]:
    """The pairs of links that a joint joins, that touch in all samples, or that never come close.

    A sample is drawn evenly between the limits of each joint, the same ones each time. Raises `RobotFault` if
    the URDF or a shape in it cannot be read.
    """
    model = read_urdf(robot)
    try:
        shapes = pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION)
    except (ValueError, RuntimeError) as fault:
        reason = " ".join(str(fault).split())[:200]
        raise RobotFault(robot.urdf_path, "collision", reason, "shapes that can be read") from None
    links = [model.frames[each.parentFrame].name for each in shapes.geometryObjects]
    order = list(dict.fromkeys(links))
    neighbours = {frozenset(pair) for pair in _joined(model)}
    wanted = {frozenset(pair): pair for pair in combinations(order, 2) if frozenset(pair) not in neighbours}
    touching = _Touching(robot, model, shapes, links, set(wanted))
    touching.sample(samples)
    found = [Pair(*pair, ADJACENT) for pair in combinations(order, 2) if frozenset(pair) in neighbours]
    for key, pair in wanted.items():
        if key not in touching.close:
            found.append(Pair(*pair, NEVER))
        elif key not in touching.apart:
            found.append(Pair(*pair, ALWAYS))
    return sorted(found, key=lambda pair: (order.index(pair.first), order.index(pair.second)))


class _Touching:
    """Which links come close in samples, and which are apart in some."""

    def __init__(
        self,
        robot: RobotDescription,
        model: pin.Model,
        shapes: pin.GeometryModel,
        links: list[str],
        wanted: set[frozenset[str]],
    ) -> None:
        self.close: set[frozenset[str]] = set()
        self.apart: set[frozenset[str]] = set()
        self._model, self._data, self._shapes = model, model.createData(), shapes
        self._indices = [model.joints[model.getJointId(name)].idx_q for name in robot.joints]
        self._limits = np.array(robot.position_min), np.array(robot.position_max)
        self._links: list[frozenset[str]] = []  # of each pair of shapes
        for first, second in combinations(range(len(links)), 2):
            pair = frozenset((links[first], links[second]))
            if pair in wanted:
                shapes.addCollisionPair(pin.CollisionPair(first, second))
                self._links.append(pair)

    def sample(self, count: int) -> None:
        exact, near = pin.GeometryData(self._shapes), pin.GeometryData(self._shapes)
        for request in near.collisionRequests:
            request.security_margin = CLEARANCE_M
        random, q = np.random.default_rng(0), pin.neutral(self._model)
        for _ in range(count):
            q[self._indices] = random.uniform(*self._limits)
            touching = self._meeting(near, q, self.close)
            self.close |= touching
            _ask_no_more(near, self._links, touching)
            apart = set(self._links) - self.apart - self._meeting(exact, q, self.apart)
            self.apart |= apart
            _ask_no_more(exact, self._links, apart)

    def _meeting(
        self, data: pin.GeometryData, q: NDArray[np.float64], known: set[frozenset[str]]
    ) -> set[frozenset[str]]:
        """The pairs of links that meet at these joint positions, but for the `known` ones, which `data` does
        not compare any more."""
        if len(known) == len(set(self._links)):
            return set()
        pin.computeCollisions(self._model, self._data, self._shapes, data, q, False)
        results = zip(self._links, data.collisionResults, strict=True)
        return {pair for pair, result in results if pair not in known and result.isCollision()}


def _ask_no_more(data: pin.GeometryData, links: list[frozenset[str]], pairs: set[frozenset[str]]) -> None:
    if pairs:
        for number, pair in enumerate(links):
            if pair in pairs:
                data.deactivateCollisionPair(number)


def _joined(model: pin.Model) -> Iterator[tuple[str, str]]:
    """The two links of each joint, also of fixed ones."""
    for frame in model.frames:
        if frame.type in (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT):
            for child in model.frames:
                if child.type == pin.FrameType.BODY and model.frames[child.parentFrame].name == frame.name:
                    yield model.frames[frame.parentFrame].name, child.name
