"""The bodies of a cell in MuJoCo, tick by tick, beside an arm whose motion is imposed.

A tick integrates what the last forces made of the parts, puts the arm where its plan has brought it, and
finds the forces there, with the accelerations that lead to where the next tick will bring it. So what is
read belongs to the places of this tick.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from math import hypot
from typing import Any, NamedTuple

import mujoco as mj
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.contact.links import LinkContact
from iiwa_sim.contact.payload import Moments, TcpMotion, body, seen_from
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform, compose, inverse, rotate, transpose
from iiwa_sim.motion.impedance import COMPLIANT_JOINTS, COMPLIANT_TCP, STIFF
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.model import Model
from iiwa_sim.wording import harmless
from iiwa_sim.world import details
from iiwa_sim.world.build import GRASPED, HEAVY, ArmShape, Built, build, pose_of, priority, wxyz
from iiwa_sim.world.details import ARM, LOST, PARTS, find_forces
from iiwa_sim.world.distances import ROOM_M, Distances
from iiwa_sim.world.gripper import CLOSES, OPENS, STAYS, Cup, Gripper, Jaws
from iiwa_sim.world.material import law_of_free, law_of_imposed
from iiwa_sim.world.part import FALLS, GONE, HELD, LIES, Part
from iiwa_sim.world.tick_kernel import BASE, way
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

HOLDS = "the gripper holds part {!r}"
LETS_GO = "part {!r} is let go: the jaws have opened"
SLIPS = "part {!r} has slipped out of the jaws"
LOSES = "part {!r} falls out of the jaws: made to through the backdoor"
REMOVED = "part {!r} is gone: made to through the backdoor"
FARTHEST_M = 10.0
"""A part that falls or rolls farther from the base along an axis is gone."""
LINKS_M = 0.25
"""No point of a link is farther from the line through its joints."""
FELT_N, ON_PAD_M = 1.0, 2e-4
"""A jaw has met a part that presses on it by more; a pad touches a part that is no farther."""
CREEPS, CREEP_LOST_PER_S = np.array([0.02] * 3 + [1.0] * 3), 1.0
"""A part slower than this (m/s, rad/s) loses this share of its speed: rolling friction hardly brakes it."""
STILL_TICKS, SLOW_M_S = 50, 5e-5
STILL = np.array([1e-4] * 3 + [1e-3] * 4)  # m, and numbers of a quaternion
"""Parts that stay within this for so many ticks, or are slow for a fifth of that, stand still."""
JAW_STILL_M = 1e-4
"""Jaws that stay within this for as many ticks stand, too, as long as what they press on does."""
TCP_INERTIA = np.array([5.0] * 3 + [0.2] * 3)
"""Apparent inertia (kg, kg m2) of a robot that gives way at its TCP."""
JOINT_INERTIA_KGM2, TURNING_KGM2 = 0.5, 0.02
"""The same of each joint of a robot that gives way in its joints, and of its TCP in rotation."""
STICKS = 1.002
"""A part that has slid is held against so many times the friction, until the force has fallen."""

Vector = NDArray[np.float64]
Tell = Callable[[str, bool], None]
"""Takes a line on a part, and True for a warning."""
NOWHERE = (0.0, 0.0)


class WorldState(NamedTuple):
    """State of a world that a named state keeps."""

    built: Built
    data: Any
    fields: dict[str, Any]


class World:
    """Bodies of a cell: surfaces, parts, the arm and its gripper."""

    def __init__(
        self,
        arm: ArmShape,
        joints: Joints,
        surfaces: Sequence[Surface],
        parts: Sequence[tuple[Part, Transform]],
        gripper: Gripper | None,
        tick_s: float,
    ) -> None:
        """The arm is at rest at joint positions (rad)."""
        self._arm, self._tick_s, self.gripper = arm, tick_s, gripper
        self._model = Model(arm.description)
        self._law = law_of_free(tick_s)
        self.parts, self._start = [part for part, _ in parts], list(parts)
        self.surfaces = tuple(surfaces)
        self.tell: Tell = lambda _line, _warns: None
        self.changes = 0
        """Counts up when a part may have another pose or state."""
        self.held = -1
        """The number of the part that the gripper holds; -1 for none."""
        self._lost = -1
        self._gone: set[int] = set()
        self._inside = IDENTITY  # the body of the held part in the TCP
        self.compliance = STIFF  # or how the robot gives way
        self._joints = self._before = joints
        self._tcp = self._tcp_before = self._tcp_older = self._model.tcp(arm.tool_in_flange).pose(joints)
        self._at: Vector = np.zeros(len(joints) + 12)
        self._motion = TcpMotion(self._tcp)
        self._moments: Moments | None = None
        self._sucks = gripper is not None and isinstance(gripper.kind, Cup)
        self._most_n = 0.0  # load that the gripper holds: of jaws, by friction
        self._slip = NOWHERE  # how fast the held part slides, along x and z of the TCP (m/s)
        self._firm, self._force_was = True, 0.0
        self._jaw_speed, self._jaws_move, self._jaw_stall = 0.0, False, 0
        self._jaw_still_m, self._jaws_rest = -1.0, False
        self._quiet = self._behind = self._frozen = False
        self._still, self._links_m, self._tool_m, self._reach_m = 0, 0.0, 0.0, 0.0
        self._still_q: Vector = np.zeros((len(self.parts), 7))
        self._distances: Distances | None = None
        self._q_was: Vector = np.zeros(0)
        self._v_was: Vector = np.zeros(0)
        self._felt_was: Vector = np.zeros(0)
        self._contacts: tuple[LinkContact, ...] | None = None
        self._touched: set[int] | None = None
        self._felt = self._on_held = self._weight = self._carried = NO_WRENCH
        self.wrench: Wrench = NO_WRENCH
        """Wrench of parts on the TCP, along its axes: contacts, and weight and inertia of the held one."""
        self.push: Wrench = NO_WRENCH
        """The same without inertia: a compliant robot gives way to that."""
        self.torques: tuple[float, ...] | None = None
        """Torques of parts on the joints, by links (Nm); None for no contact."""
        self._build(None)
        self.wake()

    @property
    def settled(self) -> bool:
        """True if ticks change nothing as long as the arm stays where it is, and outputs as they are."""
        stands = self._joints == self._before and not self._jaws_move and not self.compliance
        return stands and (self._frozen or (self._quiet and (self.held < 0 or bool(self._motion.still))))

    def pose(self, number: int) -> Transform:
        """Return the pose of a part in the base."""
        is_held, offset = number == self.held, self._built.offsets[number]
        at = compose(self._tcp, self._inside) if is_held else pose_of(self._part_q[number].tolist())
        return at if offset is None else compose(at, offset)

    def state(self, number: int) -> str:
        """Return the state of a part: lies, falls, held or gone."""
        if number in self._gone:
            return GONE
        if number == self.held:
            return HELD
        if self._touched is None:
            geoms = set(self._data.contact.geom.ravel().tolist())
            self._touched = {self._numbers[geom] for geom in geoms & self._numbers.keys()}
        rests = self._data.body_awake[self._bodies[number]] == 0 or number in self._touched
        return LIES if rests else FALLS

    def near(self, number: int, within_m: float) -> list[str]:
        """Return the names of the surfaces and parts that are no farther from a part."""
        self._catch_up(now=True)
        geom = self._geoms[number]
        others = [other for other in self._names if other != geom]
        return [self._names[other] for other in others if self._apart(geom, other) <= within_m]

    @property
    def contacts(self) -> tuple[LinkContact, ...]:
        """Return contacts of links, tool and jaws with parts: deepest point and summed force of each pair."""
        if self._contacts is None:
            data, touching, force = self._data, self._built.touching, np.zeros(6)
            found: dict[tuple[str, str], tuple[float, Any, Any]] = {}
            for k, (a, b) in enumerate([] if self._behind else data.contact.geom.tolist()):
                arm, part = (a, b) if a in touching else (b, a)
                if arm not in touching or (self._jaws_move and arm in self._built.fingers):
                    continue  # no contact of the arm, or jaws that grip or let go
                mj.mj_contactForce(self._built.model, data, k, force)
                if force[0] > 0.0:
                    acting = data.contact.frame[k].reshape(3, 3).T @ force[:3] * (-1.0 if arm == a else 1.0)
                    names, here = (
                        (touching[arm], self._names[part]),
                        (data.contact.dist[k], data.contact.pos[k]),
                    )
                    *other, total = found.get(names, (*here, 0.0))
                    found[names] = (*min(here, other, key=lambda each: each[0]), total + acting)
            each = found.items()
            self._contacts = tuple(
                LinkContact(*n, tuple(p.tolist()), tuple(f.tolist())) for n, (_, p, f) in each
            )
        return self._contacts

    def step(
        self,
        joints: Joints,
        coming: Joints | None,
        tcp: Transform,
        coming_tcp: Transform | None,
        driven: int,
        compliance: int,
    ) -> None:
        """Make a tick, which has brought the arm to `joints` (rad); the next one brings it to `coming`."""
        self._before, self._joints = self._joints, joints
        self._tcp_older, self._tcp_before, self._tcp = self._tcp_before, self._tcp, tcp
        far_m, tcp_m, turned = way(joints, tcp, self._at, self._levers)
        jaw_m = 0.0
        if compliance or self.compliance:
            self._comply(compliance)
        gripper = self.gripper
        if gripper is not None and not (self._jaws_rest and driven == gripper.driven):
            jaw_m = self._drive(gripper, driven)
        if self._frozen and far_m + jaw_m == 0.0:
            return
        carried = self._carried
        if self._moments is not None:
            self.changes += 1
            self._motion.step(tcp, self._tick_s, coming_tcp)
            self._carried = self._weight = carried = self._motion.wrench(self._moments)
            if compliance:
                self._weight = self._motion.weight(self._moments)
            self._quiet = self._quiet and self._load_n(carried) <= self._most_n
        if self._quiet:
            if self._distances is None:
                self._links_m = self._tool_m = 0.0
            links_m, tool_m = self._links_m - far_m, self._tool_m - tcp_m - self._reach_m * turned - jaw_m
            if links_m < ROOM_M:
                links_m = self._room(of_tool=False) - far_m
            if tool_m < ROOM_M:
                tool_m = self._room(of_tool=True) - tcp_m - self._reach_m * turned - jaw_m
            self._links_m, self._tool_m = links_m, tool_m
            if links_m >= ROOM_M and tool_m >= ROOM_M:
                self._behind, self._felt, self.torques, self._contacts = True, NO_WRENCH, None, ()
                self.wrench, self.push = carried, self._weight
                if self._jaws_move:
                    self._move_jaws(computed=False)
                return
        self._compute(coming, coming_tcp, far_m + jaw_m)
        self._sum()

    def _compute(self, coming: Joints | None, coming_tcp: Transform | None, far: float) -> None:
        self._catch_up(now=False)
        mj.mj_Euler(self._built.model, self._data)
        creeps = (np.abs(self._part_v) < CREEPS).all(axis=1)
        self._part_v[creeps] *= 1.0 - CREEP_LOST_PER_S * self._tick_s
        self._impose(coming, coming_tcp)
        self._find_forces()
        if self._lost >= 0:
            self._watch_lost()
        for number in np.nonzero((np.abs(self._part_q[:, :3]) > FARTHEST_M).any(axis=1))[0].tolist():
            self._take_away(number)
        self.changes += 1
        quiet = details.is_quiet(self._data, 2 + (self.held >= 0))
        if not (quiet and self._quiet):
            self._distances = None
        self._quiet = quiet and self._slip == NOWHERE
        stands = far == 0.0 and not self.compliance and (self.held < 0 or self._motion.still)
        if not stands or (np.abs(self._part_q - self._still_q) > STILL).any():
            self._still = 0
            self._still_q[:] = self._part_q
        self._still += 5 if stands and np.abs(self._part_v).max() < SLOW_M_S else 1
        self._frozen = self._still > STILL_TICKS
        if self._frozen:
            self._part_v[:] = 0.0

    def _impose(self, coming: Joints | None, coming_tcp: Transform | None) -> None:
        """Give arm, gripper and held part the pose, velocity and acceleration of this tick."""
        h, data, dofs, n = self._tick_s, self._data, self._dofs, len(self._joints)
        before = self._q_was
        if self._slip != NOWHERE:
            x, y, z = self._inside.translation
            moved = (x + self._slip[0] * h, y, z + self._slip[1] * h)
            self._inside = self._inside._replace(translation=moved)
            self._weigh_held()
            # What it touches rubs on it as fast as the gripper goes: it slides as friction lets it.
            self._place_imposed(before, self._before, self._tcp_before)
        self._place_imposed(data.qpos, self._joints, self._tcp)
        self._part_push[:] = details.gyroscopic(self._built.masses, self._part_v, h)
        self._move_jaws(computed=True)
        v, was, felt = self._velocity(before, data.qpos), self._v_was, self._acting[dofs]
        if self.compliance:
            # The mean velocity of a tick has half of what acted before it, and half of what did earlier.
            push = self._inertia * (v - was) / h - 0.5 * (felt + self._felt_was)
            push[:n] = JOINT_INERTIA_KGM2 * (v[:n] - was[:n]) / h - felt[:n]
        elif coming is None or coming_tcp is None:
            push = np.zeros(len(dofs))
        else:
            ahead = data.qpos.copy()
            self._place_imposed(ahead, coming, coming_tcp)
            push = (HEAVY / h) * (self._velocity(data.qpos, ahead) - v)
        self._v_was, self._felt_was = v, felt
        data.qvel[dofs], data.qfrc_applied[dofs] = v, push
        before[:] = data.qpos

    def _velocity(self, before: Vector, now: Vector) -> Vector:
        """Return the velocity of what is imposed, between positions a tick apart."""
        v = np.zeros(self._built.model.nv)
        mj.mj_differentiatePos(self._built.model, v, self._tick_s, before, now)
        imposed: Vector = v[self._dofs]
        return imposed

    def _place_imposed(self, q: Vector, joints: Joints, tcp: Transform) -> None:
        """Write the poses of arm, gripper and held part into positions."""
        n = len(joints)
        q[:n], q[n : n + 7] = joints, _position(tcp)
        if self.held >= 0:
            first = self._part_first + 7 * self.held
            q[first : first + 7] = _position(compose(tcp, self._inside))

    def _find_forces(self) -> None:
        """Find the forces where everything is, and what they do to the arm and to what it holds."""
        data, built = self._data, self._built
        find_forces(built.model, data, built.points, built.stands, self._of_arm, self._tick_s)
        self._contacts = self._touched = self.torques = None
        self._felt = self._on_held = NO_WRENCH
        if data.ncon:
            n = len(self._joints)
            self._felt = self._at_tcp(n, IDENTITY)
            if self.held >= 0:
                self._on_held = self._at_tcp(self._held_dof, self._inside)
            torques = self._acting[:n].tolist()
            self.torques = tuple(torques) if any(torques) else None
        if self.held >= 0:
            self._slide()

    def _at_tcp(self, first: int, inside: Transform) -> Wrench:
        """Return the wrench of contacts on a free body at a pose in the TCP; its dofs begin at `first`."""
        x, y, z, a, b, c = self._acting[first : first + 6].tolist()
        if x == y == z == a == b == c == 0.0:
            return NO_WRENCH
        x, y, z = rotate(transpose(self._tcp.rotation), (x, y, z))
        a, b, c = rotate(inside.rotation, (a, b, c))
        dx, dy, dz = inside.translation
        return x, y, z, a + dy * z - dz * y, b + dz * x - dx * z, c + dx * y - dy * x

    def _sum(self) -> None:
        """Add up what acts at the TCP."""
        self.wrench = self.push = self._felt
        if self.held >= 0:
            self.wrench = add(self._felt, self._at_most(add(self._carried, self._on_held)))
            self.push = add(self._felt, self._at_most(add(self._weight, self._on_held)))

    def _drive(self, gripper: Gripper, driven: int) -> float:
        """Have outputs drive the gripper for a tick; returns how far (m) a jaw goes at most."""
        if gripper.stuck:
            gripper.blocked = gripper.blocked and self.held >= 0
            self._jaws_move, self._jaw_speed = False, 0.0
            return 0.0
        self._jaws_move, self._jaws_rest, gripper.driven = driven != gripper.driven, False, driven
        if driven == OPENS and self.held >= 0:
            self.let_go(LETS_GO)
        closes = driven == CLOSES and self.held < 0 and (self._sucks or gripper.opening_m > 0.0)
        if isinstance(gripper.kind, Cup):
            if closes and (found := self._meets(self._built.fingers[0])):
                self._hold(min(found))
            gripper.blocked = self.held >= 0
            return 0.0
        if self.held < 0:
            press_n = min(self._acting[self._jaw_dofs].tolist())
            gripper.blocked = driven != OPENS and press_n > min(FELT_N, 0.5 * gripper.kind.force_n)
        if closes and gripper.blocked and (number := self._between_pads()) >= 0:
            gripper.opening_m += self._pressed_in_m(number)
            self._hold(number)
        end_m = 0.0 if driven == CLOSES else gripper.stroke_m
        if self._jaws_move:
            self._jaw_stall = 0
            self._jaw_v[:] = 0.5 * gripper.kind.speed_m_per_s * driven
        if self.held >= 0 or driven == STAYS or gripper.opening_m == end_m:
            self._jaw_speed, self._jaws_rest = 0.0, not self._jaws_move
            return 0.0
        if self._jaw_stall >= STILL_TICKS:
            return 0.0
        self._jaws_move = True
        return 0.5 * gripper.kind.speed_m_per_s * self._tick_s

    def _move_jaws(self, *, computed: bool) -> None:
        """Move the jaws by a tick, both as fast as their force allows the one that is held up more."""
        gripper, jaws = self.gripper, None if self.gripper is None else self.gripper.kind
        if gripper is None or not isinstance(jaws, Jaws):
            return
        h, driven = self._tick_s, gripper.driven
        wanted = 0.5 * jaws.speed_m_per_s * driven
        end_m = 0.0 if driven == CLOSES else gripper.stroke_m
        drives = self.held < 0 and driven != STAYS and not gripper.stuck and gripper.opening_m != end_m
        if drives:
            speed = wanted
            if computed:
                speed = float(max(self._jaw_v) if driven == CLOSES else min(self._jaw_v))
                speed = wanted if abs(speed - wanted) < 1e-3 * abs(wanted) else speed
                speed = min(max(speed, -abs(wanted)), abs(wanted))
            was_m = gripper.opening_m
            gripper.opening_m = min(max(was_m + 2.0 * h * speed, 0.0), gripper.stroke_m)
            self._jaw_speed = 0.5 * (gripper.opening_m - was_m) / h
            least_m = min(JAW_STILL_M, 0.25 * abs(wanted) * STILL_TICKS * h)
            if abs(gripper.opening_m - self._jaw_still_m) > least_m:
                self._jaw_stall, self._jaw_still_m = 0, gripper.opening_m
            self._jaw_stall += 1
            self._set_tip()
        if computed:
            drives = drives and gripper.opening_m != end_m
            mass = jaws.force_n * h / abs(wanted) if drives else HEAVY
            force = mass * (wanted - self._jaw_speed) / h if drives else 0.0
            self._built.model.dof_armature[self._jaw_dofs] = mass
            self._jaw_q[:], self._jaw_v[:] = 0.5 * gripper.opening_m, self._jaw_speed
            self._data.qfrc_applied[self._jaw_dofs] = min(max(force, -jaws.force_n), jaws.force_n)

    def _set_tip(self) -> None:
        """Have the contact sphere meet parts only between jaws that are closer than it is thick."""
        tip, gripper, model = self._built.tip, self.gripper, self._built.model
        if tip < 0 or gripper is None or isinstance(gripper.kind, Cup):
            return
        bit = ARM if gripper.opening_m < 2.0 * self._arm.radius_m else 0
        if model.geom_contype[tip] != bit:
            model.geom_contype[tip], model.geom_conaffinity[tip] = bit, PARTS if bit else 0
            self._distances = None

    def _between_pads(self) -> int:
        """Return the number of a part that both pads press on along their axis; -1 for none."""
        y = self._data.xmat[self._gripper_body].reshape(3, 3)[:, 1]
        across = np.abs(self._data.contact.frame[:, :3] @ y) > 0.7
        one, two = (self._meets(geom, across) for geom in self._built.fingers)
        return min(filter(self._is_on_pads, one & two), default=-1)

    def _meets(self, geom: int, which: Any = slice(None)) -> set[int]:
        """Return the numbers of the parts in these contacts of a geom, without one that was lost."""
        pairs = self._data.contact.geom[which].tolist()
        others = {b if a == geom else a for a, b in pairs if geom in (a, b)}
        return {self._numbers[other] for other in others & self._numbers.keys()} - {self._lost}

    def _is_on_pads(self, number: int) -> bool:
        """Return True if both pads touch a part."""
        return all(self._apart(self._geoms[number], pad) < ON_PAD_M for pad in self._built.pads)

    def _pressed_in_m(self, number: int) -> float:
        """Return how deep both jaws are in a part, together."""
        geom, contact = self._geoms[number], self._data.contact
        pairs = [set(pair) for pair in contact.geom.tolist()]
        of_each = [contact.dist[[pair == {finger, geom} for pair in pairs]] for finger in self._built.fingers]
        return -float(sum(min(dist.tolist(), default=0.0) for dist in of_each))

    def _hold(self, number: int) -> None:
        """Hold a part where it is, from now on."""
        self.held = number
        pose = pose_of(self._part_q[number].tolist())
        self._inside = compose(inverse(self._tcp_before), pose)
        self._motion = TcpMotion(self._tcp_before)
        self._slip, self._firm, self._force_was = NOWHERE, True, 0.0
        assert self.gripper is not None
        force_n = self.gripper.kind.force_n
        self._most_n = force_n if self._sucks else 2.0 * self.parts[number].friction * force_n
        self._q_was[:] = self._data.qpos
        self._weigh_held()
        self._note_imposed()
        self._weigh_imposed()
        self._wake_up()
        self._say(HOLDS, number)

    def let_go(self, why: str = LOSES) -> None:
        """Let the held part go on with the velocity of the gripper."""
        number, data = self.held, self._data
        if self._behind:  # the velocity is that of the last tick, which was not computed
            older = data.qpos.copy()
            self._place_imposed(older, self._before, self._tcp_older)
            self._catch_up(now=False)
            self._part_v[number] = self._velocity(older, data.qpos)[-6:]
        self.held, self._moments, self._slip, self._jaws_rest = -1, None, NOWHERE, False
        self._on_held = self._weight = self._carried = NO_WRENCH
        self._lost = number
        at, geom, model = self._bodies[number], self._geoms[number], self._built.model
        details.set_free(model, data, at, geom, self._built.masses[number], LOST)
        details.set_law(model, geom, self._law, priority(self.parts[number], self._tick_s))
        self._note_imposed()
        self._wake_up()
        if self.gripper is not None:
            self.gripper.blocked = False
        if why:
            self._say(why, number)

    def remove(self, number: int) -> None:
        """Take a part away."""
        if number == self.held:
            self.let_go("")
        self._take_away(number)
        self.wake()
        self._say(REMOVED, number)

    def _take_away(self, number: int) -> None:
        self._gone.add(number)
        if self._lost == number:
            self._lost = -1
        details.set_gone(self._built.model, self._data, self._bodies[number], self._geoms[number])
        self._part_q[number, :3] = 0.0, 0.0, -FARTHEST_M
        self.changes += 1

    def _watch_lost(self) -> None:
        """Have a part that the gripper has lost meet the arm again, when it is out of it."""
        geom, model = self._geoms[self._lost], self._built.model
        near = [*self._built.fingers, *([self._built.tip] if self._built.tip >= 0 else [])]
        if all(self._apart(geom, other) > ROOM_M for other in near):
            model.geom_contype[geom], model.geom_conaffinity[geom] = PARTS, details.ALL
            self._lost = -1
            self._wake_up()

    def _load_n(self, wrench: Wrench) -> float:
        """Return the force of a wrench along the pads, or that pulls at the cup (N)."""
        x, y, z = wrench[:3]
        return hypot(x, y, max(z, 0.0)) if self._sucks else hypot(x, z)

    def _at_most(self, wrench: Wrench) -> Wrench:
        """Return a wrench on the held part as the gripper feels it: along the pads at most friction."""
        load, most = self._load_n(wrench), self._most_n * (1.0 if self._firm else STICKS)
        if load <= most or self._sucks:
            return wrench
        share = most / load - 1.0
        fx, fz = share * wrench[0], share * wrench[2]
        x, y, z = self._inside.translation
        return add(wrench, (fx, 0.0, fz, y * fz, z * fx - x * fz, -y * fx))

    def _slide(self) -> None:
        """Let the part slide while what acts along the pads is more than their friction."""
        load = add(self._carried, self._on_held)
        if self._sucks:
            if self._load_n(load) > self._most_n:
                self.let_go(SLIPS)
            return
        h, limit = self._tick_s, self._most_n
        x, _, z = load[:3]
        force, (sx, sz) = hypot(x, z), self._slip
        self._firm = force < limit and (self._firm or force < 0.9 * limit)
        grows, self._force_was = max(force - self._force_was, 0.0), force
        if self._slip == NOWHERE and force + grows <= limit * (1.0 if self._firm else STICKS):
            return
        self._firm = False
        # With such a mass a tick takes the force away. That of the next tick, which grows on as it does, is
        # to be the limit; friction is along the way on which the part would go on without it.
        gain = h / (self._stiffness() * h * h or self.parts[self.held].mass_kg)
        more = gain * (1.0 + grows / force) if force else gain
        on_x, on_z = sx + more * x, sz + more * z
        on = hypot(on_x, on_z)
        share = max(0.0, 1.0 - limit * gain / on) if on else 0.0
        self._slip = (share * on_x, share * on_z)
        self._still, self._frozen, self._quiet = 0, False, False
        if not self._is_on_pads(self.held):
            self.let_go(SLIPS)

    def _stiffness(self) -> float:
        """Return the stiffness (N/m) of the stiffest contact of what is held; 0 without one."""
        model, geom = self._built.model, self._geoms[self.held]
        soft, of = model.body_invweight0[:, 0], model.geom_bodyid
        both = [soft[of[a]] + soft[of[b]] for a, b in self._data.contact.geom.tolist() if geom in (a, b)]
        return float(BASE * self._law.scale / min(both)) if both else 0.0

    def _weigh_held(self) -> None:
        """Find the moments of the held part as they are in the TCP."""
        kg, *_, xx, yy, zz = self._built.masses[self.held].tolist()
        own = body(kg, (0.0, 0.0, 0.0), (xx, yy, zz, 0.0, 0.0, 0.0))
        self._moments = seen_from(own, self._inside)

    def _note_imposed(self) -> None:
        """Note which dofs are imposed: those of the arm, the gripper, and the held part."""
        n, model = len(self._joints), self._built.model
        self._held_dof = int(model.body_dofadr[self._bodies[self.held]]) if self.held >= 0 else -1
        held = range(self._held_dof, self._held_dof + 6) if self.held >= 0 else range(0)
        self._dofs = np.array([*range(n + 6), *held])
        self._of_arm = np.array([*range(self._jaw_dofs.stop), *held])  # and the jaws
        self._v_was, self._felt_was = self._data.qvel[self._dofs], np.zeros(len(self._dofs))

    def _comply(self, compliance: int) -> None:
        """Impose the apparent inertia of a compliant robot, or make all heavy again."""
        changed, self.compliance = compliance != self.compliance, compliance
        if changed or compliance == COMPLIANT_JOINTS:
            self._weigh_imposed()
        if changed:
            self._still, self._frozen = 0, False

    def _weigh_imposed(self) -> None:
        """Set the inertia of all that is imposed, and the contact law of the held part."""
        model, n, compliant = self._built.model, len(self._joints), self.compliance != STIFF
        inertia = TCP_INERTIA if self.compliance == COMPLIANT_TCP else np.full(6, HEAVY)
        if self.compliance == COMPLIANT_JOINTS:
            # No more than the joints have at the TCP, in the direction in which they have the least.
            jacobian = self._model.tcp(self._arm.tool_in_flange).jacobian(self._joints)[:3]
            most = float(np.linalg.eigvalsh(jacobian @ jacobian.T)[-1])
            mass = min(JOINT_INERTIA_KGM2, 0.5 * JOINT_INERTIA_KGM2 / most)
            inertia = np.array([mass] * 3 + [TURNING_KGM2] * 3)
        joints = np.full(n, JOINT_INERTIA_KGM2 if compliant else HEAVY)
        self._inertia = np.concatenate([joints, inertia, inertia[: 6 * (self.held >= 0)]])
        model.dof_armature[: n + 6] = self._inertia[: n + 6]
        if self.held >= 0:
            at, geom = self._bodies[self.held], self._geoms[self.held]
            details.set_imposed(model, at, geom, inertia)
            details.set_law(model, geom, self._law if compliant else law_of_imposed(self._law), GRASPED)

    def place(self, joints: Joints, tcp: Transform, tool_in_flange: Transform) -> None:
        """Put the arm, and what it holds, at rest at joint positions (rad)."""
        self._joints = self._before = joints
        self._tcp = self._tcp_before = self._tcp_older = tcp
        way(joints, tcp, self._at, self._levers)
        if tool_in_flange != self._arm.tool_in_flange:
            self._arm = self._arm._replace(tool_in_flange=tool_in_flange)
            self._build(self._data)
        self._put(joints, tcp)
        if self._moments is not None:
            self._motion.rest(tcp)
            self._weight = self._carried = self._motion.weight(self._moments)
        self.wake()

    def set_surfaces(self, surfaces: Sequence[Surface]) -> None:
        """Have these surfaces from now on; those that only moved push what is in their way."""
        before, self.surfaces = self.surfaces, tuple(surfaces)
        was, now = ([each._replace(pose=IDENTITY) for each in of] for of in (before, self.surfaces))
        if was != now:
            self._build(self._data)
        model = self._built.model
        for at, each in zip(self._built.surfaces.tolist(), self.surfaces, strict=True):
            model.body_pos[at], model.body_quat[at] = each.pose.translation, wxyz(each.pose.rotation)
        self.wake()

    def wake(self) -> None:
        """Look at everything anew, after a change from outside."""
        self._catch_up(now=True)
        details.wake_all(self._built.model, self._data)
        self._wake_up()
        self._find_forces()
        self._sum()

    def _wake_up(self) -> None:
        self.changes += 1
        self._quiet = self._frozen = False
        self._still, self._distances = 0, None

    def kept(self) -> WorldState:
        """Return the state, for `restore`."""
        fields = {name: copy.copy(value) for name, value in vars(self).items() if name not in _SHARED}
        built = self._built._replace(model=copy.copy(self._built.model))
        return WorldState(built, copy.copy(self._data), fields | {"_motion": self._motion.copy()})

    def restore(self, state: WorldState) -> None:
        """Bring a kept state back; the next ticks are the same to the last bit as after it was kept."""
        kept = {name: copy.copy(value) for name, value in state.fields.items() if name != "_motion"}
        vars(self).update(kept, _motion=state.fields["_motion"].copy())
        self._bind(state.built._replace(model=copy.copy(state.built.model)), copy.copy(state.data))
        self._q_was = kept["_q_was"]
        self.changes += 1

    def _build(self, before: Any) -> None:
        """Build the model for the present surfaces and tool; bodies go on from where they are in `before`."""
        kind = None if self.gripper is None else self.gripper.kind
        built = build(self._arm, kind, self.surfaces, self._start, self._law, self._tick_s)
        data = mj.MjData(built.model)
        if before is not None:
            data.qpos[:], data.qvel[:] = before.qpos, before.qvel
            data.qacc_warmstart[:] = before.qacc_warmstart
        self._bind(built, data)
        for number in self._gone:
            details.set_gone(built.model, data, self._bodies[number], self._geoms[number])
        if self._lost >= 0:
            at, geom = self._bodies[self._lost], self._geoms[self._lost]
            details.set_free(built.model, data, at, geom, built.masses[self._lost], LOST)
        self._note_imposed()
        self._weigh_imposed()
        self._put(self._joints, self._tcp)
        self._set_tip()

    def _bind(self, built: Built, data: Any) -> None:
        """Take views of the arrays of a model and its data."""
        self._built, self._data, model, n = built, data, built.model, len(self._joints)
        jaws = len(built.pads) if self.gripper is not None and isinstance(self.gripper.kind, Jaws) else 0
        self._gripper_body: int = model.body("gripper").id
        self._part_first = n + 7 + jaws
        self._jaw_dofs = slice(n + 6, n + 6 + jaws)
        self._jaw_q: Vector = data.qpos[n + 7 : n + 7 + jaws]
        self._jaw_v: Vector = data.qvel[self._jaw_dofs]
        self._part_q: Vector = data.qpos[self._part_first :].reshape(-1, 7)
        self._part_v: Vector = data.qvel[n + 6 + jaws :].reshape(-1, 6)
        self._q_was = data.qpos.copy()
        self._part_push: Vector = data.qfrc_applied[n + 6 + jaws :].reshape(-1, 6)
        self._acting: Vector = data.qfrc_constraint[:]
        self._geoms: list[int] = built.parts.tolist()
        self._bodies: list[int] = model.geom_bodyid[built.parts].tolist()
        self._numbers = {geom: number for number, geom in enumerate(self._geoms)}
        of_body = dict(zip(built.surfaces.tolist(), self.surfaces, strict=True))
        of_geom = enumerate(model.geom_bodyid.tolist())
        self._names = {geom: of_body[at].name for geom, at in of_geom if at in of_body}
        self._names |= {geom: self.parts[number].name for geom, number in self._numbers.items()}
        self._levers: Vector = np.array(self._model.tcp_of_flange.longest_levers()) + LINKS_M
        details.never_sleeps(model, int(model.jnt_bodyid[0]))
        details.never_sleeps(model, self._gripper_body)

    def _put(self, joints: Joints, tcp: Transform) -> None:
        """Put the arm at rest there, with what it holds."""
        data = self._data
        self._place_imposed(data.qpos, joints, tcp)
        for array in (data.qvel, data.qfrc_applied, data.qacc):
            array[self._dofs] = 0.0
        data.qacc[self._jaw_dofs] = 0.0
        if self.gripper is not None:
            self._jaw_q[:], self._jaw_v[:] = 0.5 * self.gripper.opening_m, self._jaw_speed
        self._q_was[:] = data.qpos
        self._v_was, self._felt_was = np.zeros((2, len(self._dofs)))

    def _room(self, *, of_tool: bool) -> float:
        """Return the distance (m) of the links, or of the gripper, from all that they may meet."""
        self._catch_up(now=False)
        if self._distances is None:
            movers = [*self._built.touching, *([self._geoms[self.held]] if self.held >= 0 else [])]
            self._distances = Distances(self._built.model, self._data, movers, self._gripper_body)
            self._reach_m = self._distances.reach_m
        return self._distances.least(self._built.model, self._data, of_tool)

    def _catch_up(self, *, now: bool) -> None:
        """Put the arm where it is, or where it was a tick ago, after ticks that were not computed."""
        if self._behind:
            self._put(*((self._joints, self._tcp) if now else (self._before, self._tcp_before)))
            mj.mj_kinematics(self._built.model, self._data)
            self._behind = False

    def _say(self, what: str, number: int) -> None:
        self.tell(harmless(what.format(self.parts[number].name)), what == SLIPS)

    def _apart(self, one: int, two: int) -> float:
        """Return the distance (m) of two geoms."""
        return float(mj.mj_geomDistance(self._built.model, self._data, one, two, 1.0, None))


_SHARED = {"_built", "_data", "_model", "_motion", "_start", "changes", "gripper", "parts", "tell"}
"""Attributes that a named state does not keep, or copies otherwise."""


def _position(pose: Transform) -> list[float]:
    """Return a pose as a place and a quaternion w x y z."""
    return [*pose.translation, *wxyz(pose.rotation)]
