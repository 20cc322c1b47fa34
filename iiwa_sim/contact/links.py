"""Contact of the links of an arm, and of its tool and jaws, with surfaces and with each other.

Links are capsules. coal finds for each near pair the penetration depth, the contact normal and the deepest
point. There the law of the TCP acts, k d (1 + b d'), with friction as a spring; J^T f gives the torques.

A surface that touches a link, or the base by more than `STANDS_M`, when the robot or the surface is placed,
pushes no link until the whole arm has been out of it. So a table may be an infinite plane.

The arm is looked at only in ticks in which something could touch, with each joint at its greatest velocity.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import dist, inf
from operator import itemgetter
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import Gaps
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model, arm_model

STANDS_M = 0.02
"""A floor may reach so far into the base."""
STIFFEST_RUB_N_PER_M = 5e3
"""Friction on links is no stiffer: a compliant robot would oscillate on it."""
FOLDED_N_PER_M, ALLOWED_M = 5e4, 0.01
"""Stiffness of links against each other, and the depth they may have: shapes of a URDF are coarse."""
LEAST_JOINTS_BETWEEN = 3
"""Links with fewer joints between them overlap or cannot meet."""
TOLERANCE_M = 1e-9
"""The greatest error of distances from cylinders; other distances are exact."""
TURNED = 0.5
"""The normal of a link in a surface has jumped if it turns by more than 60 degrees in a tick."""
THROUGH_M = 0.05
"""A link that has gone through a surface is released at this distance behind it."""
FAR_M = 1e9
NEAR_M = 0.03
"""Capsules of a link whose hull is farther away are not measured."""
MARGIN_M = 0.1
"""Distance that jaws may move before levers are computed again."""
LEAST_INERTIA_KGM2 = 0.2
"""No compliant arm has less about a joint, except near singular poses."""
FOLLOWS, LEAST_PUSH_N = 0.1, 1e-3
"""Share by which an average force follows in a tick, and below which it is 0."""
_REQUEST, _RESULT = coal.DistanceRequest(), coal.DistanceResult()
_REQUEST.gjk_tolerance = TOLERANCE_M

Array = NDArray[np.float64]


class Worn(NamedTuple):
    """A capsule fixed to the flange, of a tool or a jaw."""

    capsule: Capsule
    """In the flange."""
    share: float = 1.0
    """Share of the stiffness, for capsules side by side."""


class LinkContact(NamedTuple):
    """A link, tool or jaw that touches a surface or a part."""

    link: str
    surface: str
    point: Vector
    """Deepest point (m, in the base)."""
    force: Vector
    """Force on the robot (N, in the base)."""


class _Memory:
    """Friction and averages of one link on one surface."""

    rubbed: Array | None = None
    """Extension of the spring (m); None before the first tick of contact."""
    push = 0.0
    """Average normal force on a compliant robot (N)."""
    drag: Array = np.zeros(3)
    """The same of friction."""


class _Body(NamedTuple):
    """A link, or a capsule of a tool or a jaw: contacts with one surface make one force."""

    name: str
    joint: int
    """Number of joints that move it."""
    capsules: tuple[int, ...]
    hull: int
    """Number of the capsule around all of them."""
    share: float = 1.0
    is_own: bool = True


class _Group(NamedTuple):
    """Pairs of capsules of two bodies, or of a body and a surface."""

    body: _Body
    surface: int | None
    hulls: tuple[int, int]
    pairs: tuple[tuple[int, int], ...]
    first: int
    """Number of joints that move both."""


class Links:
    """The links of one arm. `step` finds what acts on them, in ticks that `gaps` do not free from it."""

    def __init__(self, model: Model, tool: Sequence[Worn] = (), *, folds: bool = True) -> None:
        """Take an arm with the capsules of its tool, among no surfaces; `folds` lets links touch."""
        self._model, self._arm = model, model.arm.pin_model
        self.gaps = Gaps([1.01 * velocity for velocity in model.description.velocity])
        """They tell when nothing can touch."""
        self._tool = tuple(tool)
        self._jaws: tuple[Worn, ...] = ()
        self._surfaces: tuple[Surface, ...] = ()
        self._names: tuple[str, ...] = ()
        self._memory: dict[tuple[int, str], _Memory] = {}
        self._entry: dict[tuple[int, str], tuple[Array, Array]] = {}
        self._muted: set[str] = set()
        self.torques: tuple[float, ...] | None = None
        """Torques of surfaces on links (Nm); None without contact."""
        self.worn: tuple[float, ...] | None = None
        """Force and torque about the origin on tool and jaws (N, Nm, in the base); None without contact."""
        self.yielding: tuple[float, ...] | None = None
        """Torques of surfaces (Nm) that a compliant robot gives way to: those of the end of the next tick."""
        self.contacts: tuple[LinkContact, ...] = ()
        self.folded: tuple[float, ...] | None = None
        """Torques of links on links (Nm)."""
        self.colliding: tuple[str, str] | None = None
        """The names of two links that are in each other, the deepest."""
        self._folding = _folding(model.description, self._tool) if folds else ()
        self._wear()

    # What there is

    def _wear(self) -> None:
        """Take the capsules of the arm, its tool and its jaws."""
        worn, model, self._jaws_off_m = (*self._tool, *self._jaws), self._arm, 0.0
        capsules, places, bodies, across, spans = _own_bodies(self._model.description)
        self._flange = model.frames[self._model.arm.flange].placement
        self._capsules, self._places, self._bodies = list(capsules), list(places), list(bodies)
        self._joint = [each.joints for each in self._capsules]
        for number, (capsule, share) in enumerate(worn, start=len(self._capsules)):
            self._bodies.append(_Body(capsule.link, model.nq, (number,), number, share, is_own=False))
        self._capsules += [each.capsule for each in worn]
        self._joint += [model.nq] * len(worn)
        self._places += [self._flange * _se3(each.capsule.pose) for each in worn]
        self._solids: list[Any] = [_capsule(each.radius_m, each.length_m) for each in self._capsules]
        self._base = pin.GeometryModel()
        for number, (joint, place) in enumerate(zip(self._joint, self._places, strict=True)):
            self._base.addGeometryObject(pin.GeometryObject(str(number), joint, place, self._solids[number]))
        # No point of a body is ever farther (m) from the axis of a joint that moves it.
        self._reach = np.zeros((len(self._bodies), model.nq))
        self._moving = sum(body.joint > 0 for body in self._bodies)
        for row, body in zip(self._reach, self._bodies, strict=True):
            reach = self._extent(body.hull) + MARGIN_M * (not body.is_own)
            for joint in range(body.joint - 1, -1, -1):
                row[joint] = reach + (across[joint] if joint + 1 < body.joint else 0.0)
                reach += spans[joint] if joint + 1 < body.joint else 0.0
        self._group()

    def _extent(self, number: int) -> float:
        """Distance (m) of the farthest point of a capsule from the origin of its joint."""
        capsule = self._capsules[number]
        return (
            float(np.linalg.norm(self._places[number].translation))
            + 0.5 * capsule.length_m
            + capsule.radius_m
        )

    def _group(self) -> None:
        """List what may touch: bodies with surfaces, one surface after another, then links."""
        del self._solids[len(self._capsules) :]
        self._solids += [_solid(surface.shape) for surface in self._surfaces]
        self._poses = [_se3(surface.pose) for surface in self._surfaces]
        self._groups: list[_Group] = []
        self._rows: dict[tuple[int, str], int] = {}
        levers = []
        for s, surface in enumerate(self._surfaces, start=len(self._capsules)):
            for number, body in enumerate(self._bodies):
                if body.joint:
                    self._rows[body.capsules[0], surface.name] = len(self._groups)
                    pairs = tuple((c, s) for c in body.capsules)
                    self._groups.append(_Group(body, s - len(self._capsules), (body.hull, s), pairs, 0))
                    levers.append(self._reach[number])
        self._groups += self._folding
        self._scene = self._base.copy()
        for surface, solid, pose in zip(
            self._surfaces, self._solids[len(self._capsules) :], self._poses, strict=True
        ):
            self._scene.addGeometryObject(pin.GeometryObject(surface.name, 0, pose, solid))
        for group in self._groups:
            self._scene.addCollisionPair(pin.CollisionPair(*group.hulls))
        self._found = self._scene.createData()
        for request in self._found.distanceRequests:
            request.gjk_tolerance = TOLERANCE_M
        for group in self._folding:
            row = self._reach[[body.capsules for body in self._bodies].index(group.body.capsules)].copy()
            row[: group.first] = 0.0
            levers.append(row)
        self.gaps.take(levers)

    def jaws_are(self, jaws: Sequence[Worn]) -> None:
        """Have jaws at new places in the flange."""
        before, self._jaws = self._jaws, tuple(jaws)
        if len(before) != len(jaws):
            self._wear()
            return
        moved = max(
            max(dist(was.start, now.start), dist(was.end, now.end))
            for (was, _), (now, _) in zip(before, jaws, strict=True)
        )
        self.gaps.approach(moved)
        self._jaws_off_m += moved
        if self._jaws_off_m > MARGIN_M:
            self._place_jaws()

    def _place_jaws(self) -> None:
        """Put the jaws where they are by now: moving capsules costs more than most ticks."""
        self._jaws_off_m, fits = 0.0, True
        for body, (capsule, _) in zip(
            self._bodies[len(self._bodies) - len(self._jaws) :], self._jaws, strict=True
        ):
            place = self._places[body.hull] = self._flange * _se3(capsule.pose)
            for scene in (self._base, self._scene):
                scene.geometryObjects[body.hull].placement = place
            fits = fits and self._extent(body.hull) <= self._reach[self._bodies.index(body), -1]
        if not fits:
            self._wear()

    def surround(self, surfaces: Mapping[str, Surface], joints: Sequence[float]) -> None:
        """Have these surfaces from now on, with the arm at joint positions (rad)."""
        before = {surface.name: surface for surface in self._surfaces}
        self._surfaces, self._names = tuple(surfaces.values()), tuple(surfaces)
        self._group()
        self._memory = {key: memory for key, memory in self._memory.items() if key[1] in surfaces}
        unmoved = {name for name, surface in before.items() if surfaces.get(name) == surface}
        self._entry = {key: entry for key, entry in self._entry.items() if key[1] in unmoved}
        self._go_to(np.array(joints))
        new = [
            s for s, name in enumerate(self._names) if name not in before and any(self._depths(s, STANDS_M))
        ]
        self._muted = (self._muted & surfaces.keys()) | {self._names[s] for s in new}

    def forget(self) -> None:
        """Have no surfaces, and know nothing of where the arm is."""
        self._surfaces, self._names = (), ()
        self._memory, self._entry, self._muted = {}, {}, set()
        self.torques = self.worn = self.yielding = self.folded = self.colliding = None
        self.contacts = ()
        self._group()

    def memory(self) -> Any:
        """Return all that influences later forces, and the forces."""
        felt = self.torques, self.worn, self.yielding, self.contacts, self.folded, self.colliding
        return felt, copy.deepcopy((self._memory, self._entry, self._muted))

    def restore(self, memory: Any) -> None:
        """Continue from such a memory, with the surfaces that are there."""
        felt, kept = memory
        self.torques, self.worn, self.yielding, self.contacts, self.folded, self.colliding = felt
        self._memory, self._entry, self._muted = copy.deepcopy(kept)
        self.gaps.forget()

    # Distances

    def _go_to(self, position: Array) -> None:
        """Compute places and Jacobians for joint positions; equal robots share the data."""
        if self._jaws_off_m:
            self._place_jaws()
        self._data = self._model.arm.data
        pin.computeJointJacobians(self._arm, self._data, position)
        pin.updateGeometryPlacements(self._arm, self._data, self._scene, self._found)

    def _distance(self, a: int, b: int) -> float:
        """Distance of two solids (m), less than 0 for a depth; details are in `_RESULT`."""
        _RESULT.clear()
        place, other = self._found.oMg[a], self._found.oMg[b]
        found: float = coal.distance(
            self._solids[a],
            coal.Transform3s(place.rotation, place.translation),
            self._solids[b],
            coal.Transform3s(other.rotation, other.translation),
            _REQUEST,
            _RESULT,
        )
        return found

    def _depths(self, s: int, base_m: float) -> list[float]:
        """Penetration depths (m) of bodies in a surface, 0 for none; `FAR_M` for the base beyond `base_m`."""
        found, number = [], len(self._capsules) + s
        for body in self._bodies:
            depth = 0.0
            if self._distance(body.hull, number) < 0.0:
                depth = max(0.0, *(-self._distance(c, number) for c in body.capsules))
            found.append(depth if body.joint else FAR_M if depth > base_m else 0.0)
        return found

    # Time

    def step(self, joints: Sequence[float], before: Sequence[float], tick: int, tick_s: float) -> None:
        """Make the tick of this number, which has brought the arm from `before` to `joints` (rad)."""
        due = self.gaps.go_to(joints)
        if self._memory:
            due = sorted({*due, *(self._rows[key] for key in self._memory)})
        if due:
            position = np.array(joints)
            self._go_to(position)
            self._measure(due, position - np.array(before), tick_s)
        self.gaps.begin(tick, tick_s)

    def _measure(self, due: Sequence[int], way: Array, tick_s: float) -> None:
        """Measure the distances of groups, all that touch among them, and find what acts."""
        for s, name in enumerate(self._names):
            first = s * self._moving
            if name in self._muted and self.gaps.free[first : first + self._moving].min() <= 0.0:
                depths = self._depths(s, 0.0)
                if any(depths):  # it is in it until the deepest body has gone so far
                    for row, depth in enumerate(depths[-self._moving :], start=first):
                        self.gaps.set(row, depth if depth == max(depths) else FAR_M)
                else:
                    self._muted.discard(name)
        torques, most, touching = np.zeros(self._arm.nq), 0.0, []
        self.colliding = None
        for row in due:
            group = self._groups[row]
            if group.surface is None:
                least = pin.computeDistance(self._scene, self._found, row).min_distance + ALLOWED_M
                if least < NEAR_M:
                    least = inf
                    for a, b in group.pairs:
                        distance = self._distance(a, b) + ALLOWED_M
                        least = min(least, distance)
                        if distance < 0.0:
                            torques += self._fold(group, distance)
                        if distance < most:
                            most, links = distance, (self._capsules[a].link, self._capsules[b].link)
                            self.colliding = links
            elif self._names[group.surface] in self._muted:
                continue
            else:
                least = pin.computeDistance(self._scene, self._found, row).min_distance
                if least < NEAR_M:
                    found = [self._deepest(c, group.surface, self._distance(c, s)) for c, s in group.pairs]
                    nearest = min(found, key=itemgetter(0))
                    least = nearest[0]
                    touching.append((group, *nearest))
            self.gaps.set(row, least)
        self.folded = None if self.colliding is None else tuple(torques.tolist())
        if touching or self.contacts or self._memory:
            self._press_all(touching, way, tick_s)

    def _deepest(self, c: int, s: int, distance: float) -> tuple[float, Array, Array]:
        """Distance, contact normal and deepest point; where the normal jumps, those of the side of entry."""
        normal, point, key = -_RESULT.normal, _RESULT.getNearestPoint1(), (c, self._names[s])
        entry = self._entry.get(key)
        if entry is not None and (
            0.0 <= distance < THROUGH_M or (distance < 0.0 and normal @ entry[0] < TURNED)
        ):
            out, place = entry
            pose, capsule = self._found.oMg[c], self._capsules[c]
            along = 0.5 * capsule.length_m * pose.rotation[:, 2]
            end = pose.translation - along * np.sign(along @ out) - capsule.radius_m * out
            behind = float((end - place) @ out)
            if behind < 0.0:
                return behind, out, end
        if distance < 0.0:
            self._entry[key] = normal, _RESULT.getNearestPoint2()
        else:
            self._entry.pop(key, None)
        return distance, normal, point

    def _fold(self, group: _Group, distance: float) -> Array:
        """Torques of two links that are in each other, on the joints between them."""
        middle = 0.5 * (_RESULT.getNearestPoint1() + _RESULT.getNearestPoint2())
        torques = FOLDED_N_PER_M * -distance * (_RESULT.normal @ _levers(self._data.J, middle))
        torques[: group.first] = torques[group.body.joint :] = 0.0
        found: Array = torques
        return found

    # What acts

    def _press_all(
        self, touching: Sequence[tuple[_Group, float, Array, Array]], way: Array, tick_s: float
    ) -> None:
        """Find what surfaces do to links, tool and jaws at their deepest points."""
        before, self._memory, self._shared = self._memory, {}, max(1, len(self.contacts))
        contacts, worn = [], np.zeros(6)
        torques, yielding = np.zeros((2, self._arm.nq))
        for (body, s, *_), distance, normal, point in touching:
            assert s is not None
            key, joint = (body.capsules[0], self._names[s]), body.joint
            kept = before.get(key)
            if distance >= 0.0 and (kept is None or kept.push == 0.0):
                continue
            self._memory[key] = kept = kept or _Memory()
            levers = _levers(self._data.J[:, :joint], point)
            gone = levers @ way[:joint]
            force, push = self._press(
                kept, self._surfaces[s], body.share, -distance, normal, levers, gone, tick_s
            )
            yielding[:joint] += push @ levers
            if distance >= 0.0:
                continue
            x, y, z = point.tolist()
            fx, fy, fz = force.tolist()
            contacts.append(LinkContact(body.name, key[1], (x, y, z), (fx, fy, fz)))
            if body.is_own:
                torques[:joint] += force @ levers
            else:
                worn += (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
        self.contacts = tuple(contacts)
        self.torques, self.yielding, self.worn = _or_none(torques), _or_none(yielding), _or_none(worn)

    def _press(
        self,
        kept: _Memory,
        surface: Surface,
        share: float,
        depth: float,
        normal: Array,
        levers: Array,
        way: Array,
        tick_s: float,
    ) -> tuple[Array, Array]:
        """Return the force on a link, and the one that a compliant robot gives way to.

        The latter is that of the end of the next tick, if the link has the least inertia it can have and its
        average force continues. So a compliant robot does not oscillate at any tick rate.
        """
        stiffness, friction = share * surface.stiffness, surface.friction
        rub_stiffness = share * min(surface.stiffness, STIFFEST_RUB_N_PER_M)
        moves, per_kg = bool(way.any()), self._shared * tick_s**2 / LEAST_INERTIA_KGM2
        speed = float(way @ normal) / tick_s
        push = pressing = stiffness * max(depth, 0.0) * max(1.0 - surface.damping * speed, 0.0)
        if moves:
            along = normal @ levers
            stiff = stiffness * per_kg * float(along @ along)
            push = max(stiffness * (depth - tick_s * speed) + stiff * kept.push, 0.0) / (1.0 + stiff)
        kept.push += (FOLLOWS if moves else 1.0) * (push - kept.push)
        if kept.push < LEAST_PUSH_N:
            kept.push = 0.0
        if friction == 0.0 or pressing == 0.0:
            kept.rubbed = None
            return pressing * normal, push * normal
        if kept.rubbed is None:
            kept.rubbed, kept.drag = np.zeros(3), np.zeros(3)
        else:
            kept.rubbed = _within(_across(kept.rubbed + way, normal), friction * pressing / rub_stiffness)
        drag = rubbing = -rub_stiffness * kept.rubbed
        if moves:
            stiff = rub_stiffness * per_kg * float((levers * levers).sum())
            ahead = rub_stiffness * (kept.rubbed + _across(way, normal))
            drag = _within((stiff * kept.drag - ahead) / (1.0 + stiff), friction * push)
        kept.drag = kept.drag + (FOLLOWS if moves else 1.0) * (drag - kept.drag)
        return pressing * normal + rubbing, push * normal + drag


@lru_cache(maxsize=16)
def _own_bodies(
    description: RobotDescription,
) -> tuple[list[Capsule], list[Any], list[_Body], list[float], list[float]]:
    """Return the capsules of links and their hulls, places in the joints, bodies, and lengths of links.

    The lengths (m) are from the axis of each joint, and from its origin, to the origin of the next joint.
    """
    own, arm = list(capsules_of(description)), arm_model(description)
    capsules, bodies = list(own), []
    for link in dict.fromkeys(each.link for each in own):
        numbers = tuple(n for n, each in enumerate(own) if each.link == link)
        hull = numbers[0] if len(numbers) == 1 else len(capsules)
        if len(numbers) > 1:
            capsules.append(_hull([own[number] for number in numbers]))
        bodies.append(_Body(link, own[numbers[0]].joints, numbers, hull))
    model, data = arm.pin_model, arm.pin_model.createData()
    pin.forwardKinematics(model, data, np.zeros(model.nq))
    places = [data.oMi[each.joints].actInv(_se3(each.pose)) for each in capsules]
    steps = [place.translation for place in list(model.jointPlacements)[2:]]
    axes = arm.local_axes[:-1]
    across = [float(np.linalg.norm(np.cross(axis, step))) for axis, step in zip(axes, steps, strict=True)]
    return capsules, places, bodies, across, [float(np.linalg.norm(step)) for step in steps]


@lru_cache(maxsize=16)
def _folding(description: RobotDescription, tool: tuple[Worn, ...]) -> tuple[_Group, ...]:
    """Return the pairs of links, and the tool, that may meet: those that are apart with the arm at home."""
    links, found = Links(Model(description), tool, folds=False), []
    links._go_to(np.array(description.home))
    for a, inner in enumerate(links._bodies):
        for outer in links._bodies[a + 1 :]:
            if outer.joint - inner.joint >= LEAST_JOINTS_BETWEEN:
                pairs = [(c, d) for c in inner.capsules for d in outer.capsules]
                apart = tuple(pair for pair in pairs if links._distance(*pair) > 0.0)
                if apart:
                    found.append(_Group(outer, None, (inner.hull, outer.hull), apart, inner.joint))
    return tuple(found)


def _hull(capsules: Sequence[Capsule]) -> Capsule:
    """Return a capsule around all of these, which move together."""
    ends = np.array([(each.start, each.end) for each in capsules]).reshape(-1, 3)
    radii = np.repeat([each.radius_m for each in capsules], 2)
    between = np.linalg.norm(ends[:, None] - ends, axis=2)
    a, b = np.unravel_index(between.argmax(), between.shape)
    start, end = ends[a], ends[b]
    along = (end - start) / max(between[a, b], 1e-9)
    share = np.clip((ends - start) @ along, 0.0, between[a, b])
    radius = float((np.linalg.norm(ends - start - share[:, None] * along, axis=1) + radii).max())
    (ax, ay, az), (bx, by, bz) = start.tolist(), end.tolist()
    return Capsule(capsules[0].link, capsules[0].joints, (ax, ay, az), (bx, by, bz), radius)


def _or_none(values: Array) -> tuple[float, ...] | None:
    return tuple(values.tolist()) if values.any() else None


def _levers(jacobian: Array, point: Array) -> Array:
    """Velocity of a point per joint velocity (3, n), from a Jacobian about the origin."""
    x, y, z = point.tolist()
    return jacobian[:3] + np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))) @ jacobian[3:]


def _across(vector: Array, normal: Array) -> Array:
    return vector - (vector @ normal) * normal


def _within(vector: Array, longest: float) -> Array:
    length = float(vector @ vector) ** 0.5
    return vector * (longest / length) if length > longest else vector


def _se3(pose: Transform) -> pin.SE3:
    return pin.SE3(np.array(pose.rotation).reshape(3, 3), np.array(pose.translation))


@lru_cache(maxsize=256)
def _capsule(radius_m: float, length_m: float) -> Any:
    return coal.Capsule(radius_m, length_m)


@lru_cache(maxsize=256)
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
