"""Contact of the links of an arm, and of its tool and jaws, with surfaces and with each other.

Links are capsules. coal finds for each near pair the penetration depth, the contact normal and the deepest
point. There the law of the TCP acts, k d (1 + b d'), with friction as a spring; J^T f gives the torques.

A link that touches a surface when the robot or the surface is placed is pushed only after it has been out of
it. A surface in which the base stands by more than `STANDS_M` pushes no link: a table may be a plane.

Pairs are measured only in ticks in which they could touch, with each joint at its greatest velocity.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate
from typing import Any, NamedTuple

import coal
import msgspec
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import Gaps
from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, compose, inverse
from iiwa_sim.robot.arm_kernel import Tcp
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model, arm_model

STANDS_M = 0.02
"""Greatest depth to which a floor may reach into the base."""
STIFFEST_RUB_N_PER_M = 5e3
"""Friction on links is no stiffer: a compliant robot would oscillate on it."""
FOLDED_N_PER_M, ALLOWED_M = 5e4, 0.01
"""Stiffness of links against each other, and the depth they may have: shapes of a URDF are coarse."""
LEAST_JOINTS_BETWEEN = 3
"""Links with fewer joints between them overlap or cannot meet."""
TOLERANCE_M = 1e-9
"""The greatest error of distances from cylinders; other distances are exact."""
FAR_M = 1e9
MARGIN_M = 0.1
"""Distance that jaws may move before levers are computed again."""
LEAST_INERTIA_KGM2 = 0.2
"""No compliant arm has less about a joint, except near singular poses."""
FOLLOWS, LEAST_PUSH_N = 0.1, 1e-3
"""Share by which an average force follows in a tick, and below which it is 0."""

Array = NDArray[np.float64]


class LinkContact(msgspec.Struct, frozen=True):
    """A link, tool or jaw that touches a surface or a part."""

    link: str
    surface: str
    point: Vector
    """Deepest point (mm, in the base); one of several with a part."""
    force: Vector
    """Force on the robot (N, in the base)."""


class LinkForces(NamedTuple):
    """Effects of contacts on an arm; None where there are none."""

    torques: tuple[float, ...] | None = None
    """Torques of surfaces on links (Nm)."""
    tool: tuple[float, ...] | None = None
    """Force and torque about the origin on tool and jaws (N, Nm, in the base)."""
    deflecting: tuple[float, ...] | None = None
    """Torques of surfaces (Nm) at the end of the next tick, which deflect a compliant robot."""
    contacts: tuple[LinkContact, ...] = ()
    folded: tuple[float, ...] | None = None
    """Torques of links on links (Nm)."""
    colliding: tuple[str, str] | None = None
    """The names of the two links that are deepest in each other."""


class _Memory:
    """Friction and averages of one body on one surface."""

    row = 0
    """Number of the pair that has touched last."""
    rubbed: Array | None = None
    """Extension of the spring (m); None before the first tick of contact."""
    push = 0.0
    """Average normal force on a compliant robot (N)."""
    drag: Array = np.zeros(3)
    """The same of friction."""


class _Pair(NamedTuple):
    """A capsule, by its number, with another one or with a surface."""

    capsule: int
    other: int
    surface: str | None
    body: int = 0
    """First capsule of the link, which makes one force with each surface."""


class _Scene(NamedTuple):
    """Capsules and surfaces in the form of Pinocchio."""

    capsules: tuple[Capsule, ...]
    joints: tuple[int, ...]
    """Number of joints that move each capsule."""
    own: int
    """Number of capsules of the arm itself."""
    model: Any
    data: Any
    """Shared by equal robots: each reads results before the next call."""
    pairs: tuple[_Pair, ...]
    """Moving capsules with each surface, then links with links."""
    gaps: tuple[Array, Array, NDArray[np.int64], Array]
    """Levers, capsules, pairs of them and distances at which these touch, as in `Gaps`."""


class Links:
    """The links of one arm. `step` finds the forces on them, in ticks that are not free by `gaps`."""

    def __init__(self, model: Model, tool: Sequence[Capsule] = ()) -> None:
        """Take an arm with the capsules of its tool, among no surfaces."""
        self._model = model
        self.gaps = Gaps([1.01 * limit for limit in model.description.velocity], model.tcp_of_flange)
        """Lower bounds of the distances of all pairs."""
        self._tool = tuple(tool)
        self._jaws: tuple[Capsule, ...] = ()
        self._jaw_places: list[Any] = []  # in the last joint
        self._find_jaws: Callable[[], Sequence[Capsule]] | None = None  # if these are older
        self.forget()

    def forget(self) -> None:
        """Have no surfaces, and know nothing of where the arm is."""
        self._surfaces: dict[str, Surface] = {}
        self._memory: dict[tuple[int, str], _Memory] = {}
        self._muted: set[tuple[int, str]] = set()
        self._based: set[str] = set()
        self.forces = LinkForces()
        self._build()

    def memory(self) -> Any:
        """Return all that influences later forces, and the forces."""
        return copy.deepcopy((self.forces, self._memory, self._muted, self._based))

    def restore(self, memory: Any) -> None:
        """Continue from such a memory, with the surfaces that are there."""
        self.forces, self._memory, self._muted, self._based = copy.deepcopy(memory)
        self.gaps.forget()

    # Scene

    def _build(self) -> None:
        """Build the scene for the present jaws and surfaces."""
        self._place_jaws()
        self._moved_m = 0.0
        self._scene = _scene(self._model.description, self._tool, self._jaws, tuple(self._surfaces.values()))
        self.gaps.take(*self._scene.gaps)

    def set_jaws(self, jaws: Callable[[], Sequence[Capsule]], moved_m: float) -> None:
        """Have jaws, which are found when they are near something, so much farther out or in than before."""
        self._find_jaws, self._moved_m = jaws, self._moved_m + moved_m
        if abs(self._moved_m) > MARGIN_M:
            self._build()
        else:
            self.gaps.approach(abs(moved_m))

    def _place_jaws(self) -> None:
        if self._find_jaws is not None:
            self._jaws, self._find_jaws, arm = tuple(self._find_jaws()), None, self._model
            flange = arm.pin_model.frames[arm.flange_index].placement
            self._jaw_places = [flange * _se3(capsule.pose) for capsule in self._jaws]

    def surround(self, surfaces: Mapping[str, Surface], joints: Sequence[float]) -> None:
        """Have these surfaces from now on, with the arm at joint positions (rad)."""
        before, self._surfaces, self._memory = self._surfaces, dict(surfaces), {}
        self._build()
        base = [each for each in capsules_of(self._model.description) if not each.joints]
        added = surfaces.keys() - before.keys()
        for name in added:
            depths = [c.radius_m - surfaces[name].nearest(*end)[0] for c in base for end in (c.start, c.end)]
            (self._based.add if max(depths, default=0.0) > STANDS_M else self._based.discard)(name)
        self._go_to(np.array(joints))
        scene = self._scene
        for row, pair in enumerate(scene.pairs):
            name = pair.surface or ""
            if name in added and pin.computeDistance(scene.model, scene.data, row).min_distance < 0.0:
                self._muted.add((pair.capsule, name))

    def _go_to(self, position: Array) -> None:
        """Compute places and Jacobians for joint positions."""
        scene, arm = self._scene, self._model
        self._place_jaws()
        for number, place in enumerate(self._jaw_places, start=len(scene.capsules) - len(self._jaws)):
            scene.model.geometryObjects[number].placement = place
        self._data = arm.data
        pin.computeJointJacobians(arm.pin_model, self._data, position)
        pin.updateGeometryPlacements(arm.pin_model, self._data, scene.model, scene.data)

    # Time

    def step(self, joints: Sequence[float], before: Sequence[float], tick: int, tick_s: float) -> None:
        """Make the tick of this number, which has brought the arm from `before` to `joints` (rad)."""
        due = self.gaps.go_to(joints)
        if self._memory:
            due = sorted({*due, *(memory.row for memory in self._memory.values())})
        if due:
            position = np.array(joints)
            self._go_to(position)
            self._measure(due, position - np.array(before), tick_s)
        self.gaps.begin(tick, tick_s)

    def _measure(self, due: Sequence[int], moved: Array, tick_s: float) -> None:
        """Measure the distances of pairs, with all that touch, and find the forces."""
        scene, colliding = self._scene, None
        torques, deepest = np.zeros(len(moved)), 0.0
        touching: dict[tuple[int, str], tuple[float, Array, Array, int]] = {}
        for row in due:
            pair, found = scene.pairs[row], pin.computeDistance(scene.model, scene.data, row)
            key, distance = (pair.capsule, pair.surface or ""), found.min_distance
            if pair.surface is None:
                distance += ALLOWED_M
                if distance < 0.0:
                    inner, outer = scene.joints[pair.capsule], scene.joints[pair.other]
                    middle = 0.5 * (found.getNearestPoint1() + found.getNearestPoint2())
                    levers = _levers(self._data.J, middle)[:, inner:outer]
                    torques[inner:outer] -= FOLDED_N_PER_M * distance * (found.normal @ levers)
                if distance < deepest:
                    deepest = distance
                    colliding = (scene.capsules[pair.capsule].link, scene.capsules[pair.other].link)
            elif pair.surface in self._based:
                distance = FAR_M
            elif key in self._muted and distance <= 0.0:
                distance = -distance
            else:
                self._muted.discard(key)
                body = pair.body, key[1]
                if (distance <= 0.0 or body in self._memory) and distance < touching.get(body, (FAR_M,))[0]:
                    touching[body] = distance, -found.normal, found.getNearestPoint1(), row
            self.gaps.set(row, distance)
        folded = None if colliding is None else tuple(torques.tolist())
        self.forces = self.forces._replace(folded=folded, colliding=colliding)
        if touching or self.forces.contacts or self._memory:
            self._press_all(touching, moved, tick_s)

    # Forces

    def _press_all(
        self, touching: Mapping[tuple[int, str], tuple[float, Array, Array, int]], moved: Array, tick_s: float
    ) -> None:
        """Find the forces of surfaces on links, tool and jaws at their deepest points."""
        scene, before, self._memory = self._scene, self._memory, {}
        sharing = max(1, len(self.forces.contacts))
        contacts, tool = [], np.zeros(6)
        torques, deflecting = np.zeros((2, len(moved)))
        for key, (distance, normal, point, row) in touching.items():
            kept, first = before.get(key), key[0]
            if distance >= 0.0 and (kept is None or kept.push == 0.0):
                continue
            self._memory[key] = kept = kept or _Memory()
            kept.row, surface, joint = row, self._surfaces[key[1]], scene.joints[first]
            is_own = first < scene.own
            levers = _levers(self._data.J[:, :joint], point)
            gone, per_kg = levers @ moved[:joint], sharing * tick_s**2 / LEAST_INERTIA_KGM2
            force, push = _press(
                kept, surface, scene.capsules[first].share, -distance, normal, levers, gone, tick_s, per_kg
            )
            deflecting[:joint] += push @ levers
            if distance >= 0.0:
                continue
            x, y, z = point.tolist()
            fx, fy, fz = force.tolist()
            at_mm, link = (1e3 * x, 1e3 * y, 1e3 * z), scene.capsules[first].link
            contacts.append(LinkContact(link, surface.name, at_mm, (fx, fy, fz)))
            if is_own:
                torques[:joint] += force @ levers
            else:
                tool += (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
        self.forces = self.forces._replace(
            torques=tuple(torques.tolist()), tool=tuple(tool.tolist()), deflecting=tuple(deflecting.tolist()),
            contacts=tuple(contacts),
        )  # fmt: skip


def _press(
    kept: _Memory, surface: Surface, share: float, depth: float, normal: Array, levers: Array, moved: Array,
    tick_s: float, per_kg: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the force on a body, and the one that deflects a compliant robot.

    The latter is the force at the end of the next tick, for a link of the least inertia under its average
    force. It keeps a compliant robot from oscillating at any tick rate.
    """
    stiffness, moves = share * surface.stiffness, bool(moved.any())
    speed = float(moved @ normal) / tick_s
    push = pressing = stiffness * max(depth, 0.0) * max(1.0 - surface.damping * speed, 0.0)
    if moves:
        along = normal @ levers
        stiff = stiffness * per_kg * float(along @ along)
        push = max(stiffness * (depth - tick_s * speed) + stiff * kept.push, 0.0) / (1.0 + stiff)
    follows = FOLLOWS if moves else 1.0
    kept.push += follows * (push - kept.push)
    if kept.push < LEAST_PUSH_N:
        kept.push = 0.0
    if surface.friction == 0.0 or pressing == 0.0:
        kept.rubbed = None
        return pressing * normal, push * normal
    rub_stiffness = share * min(surface.stiffness, STIFFEST_RUB_N_PER_M)
    across = moved - (moved @ normal) * normal
    if kept.rubbed is None:
        kept.rubbed, kept.drag = np.zeros(3), np.zeros(3)
    else:
        rubbed = kept.rubbed + across - (kept.rubbed @ normal) * normal
        kept.rubbed = _within(rubbed, surface.friction * pressing / rub_stiffness)
    drag = rubbing = -rub_stiffness * kept.rubbed
    if moves:
        stiff = rub_stiffness * per_kg * float((levers * levers).sum())
        ahead = (stiff * kept.drag + rubbing - rub_stiffness * across) / (1.0 + stiff)
        drag = _within(ahead, surface.friction * push)
    kept.drag = kept.drag + follows * (drag - kept.drag)
    return pressing * normal + rubbing, push * normal + drag


@lru_cache(maxsize=16)
def _scene(
    description: RobotDescription,
    tool: tuple[Capsule, ...],
    jaws: tuple[Capsule, ...],
    surfaces: tuple[Surface, ...],
) -> _Scene:
    """Build the scene of an arm among surfaces."""
    arm, own, fixed = arm_model(description), capsules_of(description), (*tool, *jaws)
    model, data, scene = arm.pin_model, arm.pin_model.createData(), pin.GeometryModel()
    pin.forwardKinematics(model, data, np.zeros(model.nq))
    capsules = (*own, *fixed)
    joints = (*(each.joints for each in own), *[model.nq] * len(fixed))
    flange = model.frames[arm.flange_index].placement
    places = [data.oMi[each.joints].actInv(_se3(each.pose)) for each in own]
    places += [flange * _se3(each.pose) for each in fixed]
    solids = [coal.Capsule(each.radius_m, each.length_m) for each in capsules]
    for joint, place, solid in [
        *zip(joints, places, solids, strict=True),
        *((0, _se3(each.pose), _solid(each.shape)) for each in surfaces),
    ]:
        scene.addGeometryObject(pin.GeometryObject(str(scene.ngeoms), joint, place, solid))

    # No point of a capsule is ever farther (m) from the axis of a joint that moves it.
    along = np.cumsum([0.0, *(np.linalg.norm(each.translation) for each in list(model.jointPlacements)[2:])])
    reach = np.zeros((len(capsules), model.nq))
    for number, (row, place, n) in enumerate(zip(reach, places, joints, strict=True)):
        far = float(np.linalg.norm(place.translation)) + MARGIN_M * (number >= len(own))
        row[:n] = far + 0.5 * capsules[number].length_m + capsules[number].radius_m + along[n - 1] - along[:n]

    links = [each.link for each in own]
    bodies = [*map(links.index, links), *range(len(own), len(capsules))]
    moving = [
        _Pair(number, s, surface.name, bodies[number])
        for s, surface in enumerate(surfaces, start=len(capsules))
        for number, n in enumerate(joints)
        if n
    ]
    meeting = _meeting(description, tool)
    folding = [_Pair(a, b, None) for a, b in meeting[1].tolist()]
    first, second = meeting[1].T
    still = np.arange(model.nq) < np.array(joints)[first, None]
    levers = np.concatenate([reach[[each.capsule for each in moving]], np.where(still, 0.0, reach[second])])
    pairs = (*moving, *folding)
    for each in pairs:
        scene.addCollisionPair(pin.CollisionPair(*each[:2]))
    found = scene.createData()
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        for request in found.distanceRequests:
            # A guess would have a distance depend, in its last bits, on those measured before.
            request.gjk_tolerance, request.enable_cached_gjk_guess = TOLERANCE_M, False
    return _Scene(capsules, joints, len(own), scene, found, pairs, (levers, *meeting))


@lru_cache(maxsize=16)
def _meeting(
    description: RobotDescription, tool: tuple[Capsule, ...]
) -> tuple[Array, NDArray[np.int64], Array]:
    """Return capsules of links and tool, the pairs that may meet, and when their lines do, as in `Gaps`.

    A pair may meet if it is apart with the arm at home.
    """
    arm, own = arm_model(description), capsules_of(description)
    frames = list(accumulate(arm.fixed_poses, compose, initial=IDENTITY))
    into = [(each, each.joints, inverse(frames[each.joints])) for each in own]
    into += [(each, arm.joint_count, arm.fixed_poses[-1]) for each in tool]
    lines = [(count, *apply(pose, each.start), *apply(pose, each.end)) for each, count, pose in into]
    capsules = np.array(lines, float).reshape(-1, 7)
    pairs = np.argwhere(capsules[:, 0] - capsules[:, :1] >= LEAST_JOINTS_BETWEEN).copy()
    touching = np.array([each.radius_m for each, *_ in into])[pairs].sum(axis=1)
    gaps = Gaps(description.velocity, Tcp(arm.fixed_poses, IDENTITY))
    gaps.take(np.zeros((len(pairs), arm.joint_count)), capsules, pairs, touching)
    apart = np.ones(len(pairs), bool)
    apart[gaps.go_to(description.home)] = False
    return capsules, pairs[apart], touching[apart] - ALLOWED_M


def _levers(jacobian: Array, point: Array) -> Array:
    """Velocity of a point per joint velocity (3, n), from a Jacobian about the origin."""
    x, y, z = point.tolist()
    return jacobian[:3] + np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))) @ jacobian[3:]


def _within(vector: Array, longest: float) -> Array:
    length = float(vector @ vector) ** 0.5
    return vector * (longest / length) if length > longest else vector


def _se3(pose: Transform) -> pin.SE3:
    return pin.SE3(np.array(pose.rotation).reshape(3, 3), np.array(pose.translation))


def _solid(shape: Shape) -> Any:
    match shape:
        case Plane():
            return coal.Halfspace(np.array((0.0, 0.0, 1.0)), 0.0)
        case Box():
            return coal.Box(*(2.0 * half for half in shape))
        case Sphere():
            return coal.Sphere(shape.radius)
        case Cylinder():
            return coal.Cylinder(shape.radius, 2.0 * shape.half_z)
