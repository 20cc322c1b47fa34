"""An arm among the bodies: its imposed motion, its gripper with the held part, and the wrench on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import hypot
from typing import TYPE_CHECKING, Any

import mujoco as mj
import numpy as np

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.contact.links import LinkContact
from iiwa_sim.contact.payload import Moments, TcpMotion, body, seen_from
from iiwa_sim.frames import IDENTITY, Transform, apply, compose, inverse, rotate, transpose
from iiwa_sim.motion.impedance import COMPLIANT_JOINTS, COMPLIANT_TCP, STIFF
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.model import arm_model
from iiwa_sim.wording import harmless
from iiwa_sim.world import details
from iiwa_sim.world.build import GRASPED, HEAVY, ArmSetup, WorldModel, pose_of, priority, wxyz
from iiwa_sim.world.details import Vector, arm_bit
from iiwa_sim.world.gripper import CLOSES, OPENS, STAYS, Cup, Gripper
from iiwa_sim.world.material import law_of_imposed
from iiwa_sim.world.tick_kernel import BASE, ROOM_M, advance, leave_out
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

if TYPE_CHECKING:
    from iiwa_sim.world.world import World

HOLDS = "the gripper holds part {!r}"
LETS_GO = "part {!r} is let go: the gripper has opened"
SLIPS = "part {!r} has slipped out of the gripper"
LOSES = "part {!r} falls out of the gripper: made to through the backdoor"
LINKS_M = 0.25
"""No point of a link is farther from the line through its joints."""
FELT_N, ON_PAD_M = 1.0, 2e-4
"""Force (N) above which a jaw has met a part; greatest distance (m) of a pad from a part that it touches."""
JAW_STANDS_M_S = 5e-4
"""Slower jaws stand, as long as the bodies that they press on do."""
TCP_INERTIA = np.array([5.0] * 3 + [0.2] * 3)
"""Apparent inertia (kg, kg m2) of a robot that is compliant at its TCP."""
JOINT_INERTIA_KGM2, TURNING_KGM2 = 0.5, 0.02
"""The same of each joint of a robot that is compliant in its joints, and of its TCP in rotation."""

NOWHERE = (0.0, 0.0)
_Step = tuple[Joints, Transform, Transform | None, int, int]


def travel_m(bounds: Sequence[float]) -> tuple[float, float, float]:
    """Return how far (m) a tick moves links, the gripper with its load, and the faster of both."""
    links_m, tcp_m, turned, reach_m = bounds[3:7]
    tool_m = tcp_m + reach_m * turned
    return links_m, tool_m, max(links_m, tool_m)


class Arm:
    """One robot of a world: `go` sets its motion in the next tick, `World.step` finds the forces on it."""

    def __init__(self, world: World, number: int, setup: ArmSetup) -> None:
        self.world, self._number, self.setup = world, number, setup
        self.name, self.gripper = setup.name, setup.gripper
        self.base: Transform | None = None if setup.base == IDENTITY else setup.base
        """Pose of the base in the world; None where they are the same."""
        self.model = arm_model(setup.description)
        self.report: Callable[[str, bool], None] = lambda _line, _warns: None
        """Takes a line on a part, and True for a warning."""
        self.held = -1
        """The number of the part that the gripper holds; -1 for none."""
        self.leads = False
        """True if it imposes the motion of the held part: the first of several arms does."""
        self.lost = -1
        """The number of a part that it has let go, and does not meet until it is out of it; -1 for none."""
        self.inside = IDENTITY  # the body of the held part in the TCP
        self.compliance = STIFF
        self.joints = self.before = setup.joints
        self.tcp = self.tcp_before = self.tcp_older = self.in_world(
            self.model.tcp(setup.tool_in_flange).pose(setup.joints)
        )
        self._next: _Step = self.joints, self.tcp, None, STAYS, STIFF
        levers = np.array(self.model.tcp_of_flange.longest_levers()) + LINKS_M
        self.bounds: Vector = np.concatenate([np.zeros(19), levers, setup.joints])
        """Lower bounds (m) of distances from links, gripper and other arms, and the motion of a tick."""
        self.bears = True
        """True if the gripper bears the forces on the held part."""
        self.motion = TcpMotion(self.tcp)
        self.moments: Moments | None = None  # of the held part, in the TCP
        self._sucks = self.gripper is not None and isinstance(self.gripper.kind, Cup)
        self._most_n = 0.0  # load that the gripper holds: of jaws, by friction
        self.slip = NOWHERE  # how fast the held part slides, along x and z of the TCP (m/s)
        self._force_was = 0.0
        self.jaw_speed = self._jaw_wants = 0.0  # of each jaw, and as outputs drive it (m/s)
        self.jaws_move = self.jaws_rest = False
        self._v_was: Vector = np.zeros(0)
        self._forces_was: Vector = np.zeros(0)
        self._on_gripper = self._on_held = self._weight = self._carried = NO_WRENCH
        self.wrench: Wrench = NO_WRENCH
        """Wrench of bodies on the TCP, along its axes: contacts, and weight and inertia of the held part."""
        self.push: Wrench = NO_WRENCH
        """The same without inertia, which deflects a compliant robot."""
        self.torques: tuple[float, ...] | None = None
        """Torques of bodies on the joints, by links (Nm); None for no contact."""

    def in_world(self, pose: Transform) -> Transform:
        """Return a pose in the world of one in the base."""
        return pose if self.base is None else compose(self.base, pose)

    def in_base(self, pose: Transform) -> Transform:
        """Return a pose in the base of one in the world."""
        return pose if self.base is None else compose(inverse(self.base), pose)

    def go(
        self, joints: Joints, tcp: Transform, coming_tcp: Transform | None, driven: int, compliance: int
    ) -> None:
        """Have the next step bring the arm to `joints` (rad); outputs drive the jaws as `driven` says.

        Poses of the TCP are in the base, `coming_tcp` is that of the step behind, if known.
        """
        if self.base is not None:
            tcp = compose(self.base, tcp)
            coming_tcp = None if coming_tcp is None else compose(self.base, coming_tcp)
        self._next = joints, tcp, coming_tcp, driven, compliance

    @property
    def stands(self) -> bool:
        """True if the arm, its jaws and the held part stand, and the arm is stiff."""
        at_rest = self.joints == self.before and not self.jaws_move and not self.compliance
        return at_rest and (self.moments is None or self.motion.still)

    @property
    def contacts(self) -> list[LinkContact]:
        """Contacts of links, tool and jaws with bodies: a point and the summed force of each pair."""
        if self.world.behind:
            return []
        data, touching, force = self._data, self._numbers.touching, np.zeros(6)
        found: dict[tuple[str, str], tuple[Any, Any]] = {}
        for k, (a, b) in enumerate(data.contact.geom.tolist()):
            own, other = (a, b) if a in touching else (b, a)
            if own not in touching or (self.jaws_move and own in self._numbers.fingers):
                continue  # no contact of the arm, or jaws that grip or let go
            mj.mj_contactForce(self._built.model, data, k, force)
            if force[0] > 0.0:
                acting = data.contact.frame[k].reshape(3, 3).T @ force[:3] * (-1.0 if own == a else 1.0)
                names = touching[own], self.world.touchable[other]
                found[names] = data.contact.pos[k], acting + found.get(names, (0.0, 0.0))[1]
        contacts = [(names, tuple(p.tolist()), tuple(f.tolist())) for names, (p, f) in found.items()]
        if self.base is not None:
            back = inverse(self.base)
            contacts = [(names, apply(back, p), rotate(back.rotation, f)) for names, p, f in contacts]
        return [LinkContact(*names, (1e3 * x, 1e3 * y, 1e3 * z), f) for names, (x, y, z), f in contacts]

    # A tick

    def begin(self) -> None:
        """Begin a tick."""
        self.before, self.tcp_older, self.tcp_before = self.joints, self.tcp_before, self.tcp
        joints, tcp, coming_tcp, driven, compliance = self._next
        self.joints, self.tcp, jaw_m = joints, tcp, 0.0
        if compliance or self.compliance:
            self._set_compliance(compliance)
        gripper = self.gripper
        if gripper is not None and not (self.jaws_rest and driven == gripper.driven):
            jaw_m = self._drive(gripper, driven)
        self.bears = True
        if self.moments is not None:
            self.motion.step(tcp, self.world.tick_s, coming_tcp)
            self._carried = self._weight = self.motion.wrench(self.moments)
            self.bears = self._load_n(self._carried) <= self._most_n
            if compliance:
                self._weight = self.motion.wrench(self.moments, moving=False)
        advance(joints, tcp, self.bounds, jaw_m)

    def leave_out(
        self, ahead: list[Joints], tick: int, load: ExternalWrench, most: tuple[float, float]
    ) -> int:
        """Make the ticks after this one in which the arm meets nothing; return how many."""
        world, known, (most_n, most_nm) = self.world, load.foreseen, most
        if known is None:
            return 0
        if self.moments is not None:
            most_n = min(most_n, self._most_n)
        made, h = 0, world.tick_s
        while (now := leave_out(ahead, made, tick, h, *known, most_n, most_nm, self.bounds)) > made:
            made = now
            self.before, self.joints = ahead[made - 1 : made + 1]
            self.tcp_before, self.tcp = load.tcp(self.before), load.tcp(self.joints)
            load.leave_out(self.before, self.joints, tick + made, h)
            if self.moments is not None:
                self.motion.step(self.tcp_before, h)
                self.motion.step(self.tcp, h)
            if made < len(ahead) - 2:
                world.is_away()
                world.behind = True
        if made and self.leads:
            world.changes += made
        return made

    def skip(self) -> None:
        """End a tick in which it meets nothing."""
        self._on_gripper, self.torques = NO_WRENCH, None
        self.wrench, self.push = self._carried, self._weight
        if self.jaws_move:
            self.move_jaws(computed=False)

    def slides(self, before: Vector) -> None:
        """Move the held part by its sliding in a tick, also in the positions `before`."""
        if self.slip == NOWHERE:
            return
        h = self.world.tick_s
        x, y, z = self.inside.translation
        moved = (x + self.slip[0] * h, y, z + self.slip[1] * h)
        self.inside = self.inside._replace(translation=moved)
        self.moments = seen_from(self._own, self.inside)
        # Bodies that it touches rub on it at the speed of the gripper: it slides as friction lets it.
        self.place_in(before, self.before, self.tcp_before)

    def place_in(self, q: Vector, joints: Joints, tcp: Transform) -> None:
        """Write the poses of arm, gripper and held part into positions."""
        q[self._q : self._q + len(joints) + 7] = *joints, *tcp.translation, *wxyz(tcp.rotation)
        if self.leads:
            first, part = self.world.part_first + 7 * self.held, compose(tcp, self.inside)
            q[first : first + 7] = *part.translation, *wxyz(part.rotation)

    def impose(self, v_of_all: Vector) -> None:
        """Give arm, gripper and held part their velocity in this tick, and the force on a compliant one."""
        h, n, data, dofs = self.world.tick_s, len(self.joints), self._data, self.dofs
        v, was, forces, push = v_of_all[dofs], self._v_was, self._acting[dofs], 0.0
        if self.compliance:
            # The mean velocity of a tick has half of the forces before it, and half of the earlier ones.
            push = self._inertia * (v - was) / h - 0.5 * (forces + self._forces_was)
            push[:n] = JOINT_INERTIA_KGM2 * (v[:n] - was[:n]) / h - forces[:n]
        self._v_was, self._forces_was = v, forces
        data.qvel[dofs], data.qfrc_applied[dofs] = v, push

    def take_forces(self) -> None:
        """Take the forces of contacts on the arm and on the held part."""
        data, first, n = self._data, self._dof, len(self.joints)
        self.torques = None
        self._on_gripper = self._on_held = NO_WRENCH
        if data.ncon:
            self._on_gripper = self._at_tcp(first + n, IDENTITY)
            if self.leads:
                self._on_held = self._at_tcp(self._held_dof, self.inside)
            torques = self._acting[first : first + n].tolist()
            self.torques = tuple(torques) if any(torques) else None
        if self.leads:
            self._slide()
        elif self.held >= 0 and not self._is_on_pads(self.held):
            self.let_go(SLIPS)
        world, lost = self.world, self.lost
        if lost >= 0 and all(world.apart(world.geoms[lost], each) > ROOM_M for each in self._numbers.fingers):
            self.lost = -1
            world.set_bits(lost)
            world.wake_up()
        self.wrench = self.push = self._on_gripper
        if self.leads:
            contact = add(self._on_gripper, self._on_held)
            self.wrench, self.push = add(contact, self._carried), add(contact, self._weight)

    def _at_tcp(self, first: int, inside: Transform) -> Wrench:
        """Return the wrench of contacts on a free body at a pose in the TCP; its dofs begin at `first`."""
        x, y, z, a, b, c = self._acting[first : first + 6].tolist()
        if x == y == z == a == b == c == 0.0:
            return NO_WRENCH
        x, y, z = rotate(transpose(self.tcp.rotation), (x, y, z))
        a, b, c = rotate(inside.rotation, (a, b, c))
        dx, dy, dz = inside.translation
        return x, y, z, a + dy * z - dz * y, b + dz * x - dx * z, c + dx * y - dy * x

    # Jaws

    def _drive(self, gripper: Gripper, driven: int) -> float:
        """Have outputs drive the gripper for a tick; returns how far (m) a jaw goes at most."""
        self.jaws_move = self.jaws_rest = False
        if gripper.stuck:
            gripper.blocked, self._jaw_wants = gripper.blocked and self.held >= 0, 0.0
            return 0.0
        is_new, gripper.driven = driven != gripper.driven, driven
        if driven == OPENS and self.held >= 0:
            self.let_go(LETS_GO)
        closes = driven == CLOSES and self.held < 0
        if isinstance(gripper.kind, Cup):
            if closes and (found := self._meets(self._numbers.fingers[0])):
                self.hold(min(found))
            gripper.blocked = self.held >= 0
            return 0.0
        if self.held < 0:
            press_n = min(self._acting[self._jaw_dofs].tolist())
            gripper.blocked = driven != OPENS and press_n > min(FELT_N, 0.5 * gripper.kind.force_n)
        if closes and gripper.blocked and (number := self._between_pads()) >= 0:
            if self.world.leader(number) is None:
                apart_m = partial(self.world.apart, self.world.geoms[number])
                gripper.opening_m -= sum(map(apart_m, self._numbers.fingers))
            self.hold(number)
        end_m = 0.0 if driven == CLOSES else gripper.stroke_m
        self._jaw_wants = 0.5 * gripper.kind.speed_m_per_s * driven
        if self.held >= 0 or driven == STAYS or gripper.opening_m == end_m:
            self.jaw_speed, self._jaw_wants, self.jaws_rest = 0.0, 0.0, not is_new
        elif is_new:
            self.jaw_speed = self._jaw_v[:] = self._jaw_wants
        wants = abs(self._jaw_wants)
        self.jaws_move = is_new or abs(self.jaw_speed) > min(JAW_STANDS_M_S, 0.5 * wants)
        return wants * self.world.tick_s if self.jaws_move else 0.0

    def move_jaws(self, *, computed: bool) -> None:
        """Move the jaws by a tick, both as fast as their force allows the one that is held up more."""
        gripper, h, wanted = self.gripper, self.world.tick_s, self._jaw_wants
        if gripper is None or self._sucks:
            return
        speed, was_m, force_n = wanted, gripper.opening_m, gripper.kind.force_n
        held = {arm.held for arm in self.world.arms if arm.leads}  # no grip force moves them
        is_free = computed and wanted != 0.0
        is_free = is_free and not any(held & self._meets(each) for each in self._numbers.fingers)
        if is_free:
            speed = float(max(self._jaw_v) if wanted < 0.0 else min(self._jaw_v))
            speed = min(max(speed, -abs(wanted)), abs(wanted))
        gripper.opening_m = min(max(was_m + 2.0 * h * speed, 0.0), gripper.stroke_m)
        self.jaw_speed = 0.5 * (gripper.opening_m - was_m) / h
        if computed:
            self._jaw_q[:], self._jaw_v[:] = 0.5 * gripper.opening_m, self.jaw_speed
            self._jaw_mass[:] = force_n * h / abs(wanted) if is_free else HEAVY
            self._jaw_push[:] = force_n * (wanted - self.jaw_speed) / abs(wanted) if is_free else 0.0

    def _between_pads(self) -> int:
        """Return the number of a part that both pads press on along their axis; -1 for none."""
        y = self._data.xmat[self._numbers.gripper].reshape(3, 3)[:, 1]
        across = np.abs(self._data.contact.frame[:, :3] @ y) > 0.7
        one, two = (self._meets(geom, across) for geom in self._numbers.fingers)
        return min(filter(self._is_on_pads, one & two), default=-1)

    def _meets(self, geom: int, which: Any = slice(None)) -> set[int]:
        """Return the numbers of the parts in these contacts of a geom, without one that was lost."""
        pairs = self._data.contact.geom[which].tolist()
        others = {b if a == geom else a for a, b in pairs if geom in (a, b)}
        numbers = self.world.numbers
        return {numbers[other] for other in others & numbers.keys()} - {self.lost}

    def _is_on_pads(self, number: int) -> bool:
        """Return True if both pads touch a part."""
        geom, apart = self.world.geoms[number], self.world.apart
        return all(apart(geom, pad) < ON_PAD_M for pad in self._numbers.pads)

    # Grasped part

    def hold(self, number: int) -> None:
        """Hold a part where it is, from now on; another arm that holds it still leads."""
        self.held = number
        if self.world.leader(number) is None:
            self.lead()
        self._say(HOLDS, number)

    def lead(self) -> None:
        """Impose the motion of the held part from now on."""
        number, world = self.held, self.world
        self.leads = True
        pose = pose_of(world.part_q[number].tolist())
        self.inside = compose(inverse(self.tcp_before), pose)
        self.motion = TcpMotion(self.tcp_before)
        self.slip, self._force_was = NOWHERE, 0.0
        assert self.gripper is not None
        force_n = self.gripper.kind.force_n
        self._most_n = force_n if self._sucks else 2.0 * world.parts[number].friction * force_n
        world.q_was[:] = self._data.qpos
        kg, *_, xx, yy, zz = self._built.masses[number].tolist()
        self._own = body(kg, (0.0, 0.0, 0.0), (xx, yy, zz, 0.0, 0.0, 0.0))
        self.moments = seen_from(self._own, self.inside)
        self.note_imposed()
        world.wake_up()

    def let_go(self, why: str = LOSES) -> None:
        """Let the held part go on with the velocity of the gripper, or with the next arm that holds it."""
        number, world, data, led = self.held, self.world, self._data, self.leads
        if led and world.behind:  # the velocity is that of the last tick, which was not computed
            older = data.qpos.copy()
            self.place_in(older, self.before, self.tcp_older)
            world.catch_up(now=False)
            world.part_v[number] = world.velocity(older, data.qpos)[self.dofs][-6:]
        self.held, self.leads, self.moments, self.slip, self.jaws_rest = -1, False, None, NOWHERE, False
        self._on_held = self._weight = self._carried = NO_WRENCH
        self.lost = number if led else -1
        self.note_imposed()
        others = [arm for arm in world.arms if arm.held == number]
        if not others:
            details.set_free(world.model, data, world.bodies[number], self._built.masses[number])
            law, first = world.law, priority(world.parts[number], world.tick_s)
            details.set_law(world.model, world.geoms[number], law, first)
            world.set_bits(number)
        elif led:
            others[0].lead()
        world.wake_up()
        if self.gripper is not None:
            self.gripper.blocked = False
        if why:
            self._say(why, number)

    def _load_n(self, wrench: Wrench) -> float:
        """Return the force of a wrench along the pads, or that pulls at the cup (N)."""
        x, y, z = wrench[:3]
        return hypot(x, y, max(z, 0.0)) if self._sucks else hypot(x, z)

    def _slide(self) -> None:
        """Let the part slide while the force along the pads is more than their friction."""
        load = add(self._carried, self._on_held)
        if self._sucks:
            if self._load_n(load) > self._most_n:
                self.let_go(SLIPS)
            return
        world, h, limit = self.world, self.world.tick_s, self._most_n
        x, _, z = load[:3]
        force, (sx, sz) = hypot(x, z), self.slip
        grows, self._force_was = max(force - self._force_was, 0.0), force
        if self.slip == NOWHERE and force + grows <= limit:
            return
        # With such a mass a tick takes the force away. That of the next tick, which grows on as it does, is
        # to be the limit; friction is along the direction in which the part would slide without it.
        gain = h / (self._stiffness() * h * h or world.parts[self.held].mass_kg)
        more = gain * (1.0 + grows / force) if force else gain
        on_x, on_z = sx + more * x, sz + more * z
        on = hypot(on_x, on_z)
        share = max(0.0, 1.0 - limit * gain / on) if on else 0.0
        self.slip = (share * on_x, share * on_z)
        world.wake_up()
        if not self._is_on_pads(self.held):
            self.let_go(SLIPS)

    def _stiffness(self) -> float:
        """Return the stiffness (N/m) of the stiffest contact of the held part; 0 without one."""
        model, geom = self._built.model, self.world.geoms[self.held]
        soft, of = model.body_invweight0[:, 0], model.geom_bodyid
        both = [soft[of[a]] + soft[of[b]] for a, b in self._data.contact.geom.tolist() if geom in (a, b)]
        return float(BASE * self.world.law.scale / min(both)) if both else 0.0

    def note_imposed(self) -> None:
        """Note and weigh the dofs that are imposed: those of the arm, the gripper, and the held part."""
        n, world, first = len(self.joints), self.world, self._dof
        self._held_dof = world.part_dof + 6 * self.held if self.leads else -1
        held = range(self._held_dof, self._held_dof + 6) if self.leads else range(0)
        self.dofs = np.array([*range(first, first + n + 6), *held])
        self._v_was, self._forces_was = self._data.qvel[self.dofs], np.zeros(len(self.dofs))
        self.weigh_imposed()

    def _set_compliance(self, compliance: int) -> None:
        """Impose the apparent inertia of a compliant robot, or make all heavy again."""
        changed, self.compliance = compliance != self.compliance, compliance
        if changed or compliance == COMPLIANT_JOINTS:
            self.weigh_imposed()
        if changed:
            self.world.wake_up()

    def weigh_imposed(self) -> None:
        """Set the inertia of all that is imposed, and the contact law of the held part."""
        world, model, n = self.world, self._built.model, len(self.joints)
        compliant = self.compliance != STIFF
        inertia = TCP_INERTIA if self.compliance == COMPLIANT_TCP else np.full(6, HEAVY)
        if self.compliance == COMPLIANT_JOINTS:
            # No more than the joints have at the TCP, in the direction in which they have the least.
            jacobian = self.model.tcp(self.setup.tool_in_flange).jacobian(self.joints)[:3]
            most = float(np.linalg.eigvalsh(jacobian @ jacobian.T)[-1])
            mass = min(JOINT_INERTIA_KGM2, 0.5 * JOINT_INERTIA_KGM2 / most)
            inertia = np.array([mass] * 3 + [TURNING_KGM2] * 3)
        joints = np.full(n, JOINT_INERTIA_KGM2 if compliant else HEAVY)
        self._inertia = np.concatenate([joints, inertia, inertia[: 6 * self.leads]])
        model.dof_armature[self._dof : self._dof + n + 6] = self._inertia[: n + 6]
        if self.leads:
            details.set_imposed(model, world.bodies[self.held], inertia)
            law = world.law if compliant else law_of_imposed(world.law)
            details.set_law(model, world.geoms[self.held], law, GRASPED)
            world.set_bits(self.held)

    # Changes from outside

    def place(self, joints: Joints, tcp: Transform, tool_in_flange: Transform) -> None:
        """Put arm and held part at rest at joint positions (rad), with the TCP there in the base."""
        world, tcp = self.world, self.in_world(tcp)
        self.joints = self.before = joints
        self.tcp = self.tcp_before = self.tcp_older = tcp
        self._next = joints, tcp, None, *self._next[3:]
        advance(joints, tcp, self.bounds, 0.0)
        if tool_in_flange != self.setup.tool_in_flange:
            self.setup = self.setup._replace(tool_in_flange=tool_in_flange)
            world.rebuild()
        self.put(joints, tcp)
        self.rest()
        world.q_was[:] = self._data.qpos
        if self.moments is not None:
            self.motion.rest(tcp)
            self._weight = self._carried = self.motion.wrench(self.moments, moving=False)
        world.wake()

    def put(self, joints: Joints, tcp: Transform) -> None:
        """Put the arm there, with the held part, after ticks that were not computed."""
        self.place_in(self._data.qpos, joints, tcp)
        if self.gripper is not None:
            self._jaw_q[:], self._jaw_v[:] = 0.5 * self.gripper.opening_m, self.jaw_speed

    def rest(self) -> None:
        """Have the arm at rest among the bodies, with the held part."""
        data = self._data
        for array in (data.qvel, data.qfrc_applied, data.qacc):
            array[self.dofs] = 0.0
        data.qacc[self._jaw_dofs] = 0.0
        self._v_was, self._forces_was = np.zeros((2, len(self.dofs)))

    def bind(self, built: WorldModel, data: Any) -> None:
        """Take views of the arrays of a model and its data."""
        self._built, self._data, model, n = built, data, built.model, len(self.joints)
        self._numbers = numbers = built.arms[self._number]
        self._q, self._dof = int(model.jnt_qposadr[numbers.hinge]), int(model.jnt_dofadr[numbers.hinge])
        jaws = 0 if self._sucks else len(numbers.fingers)
        q, dof = self._q + n + 7, self._dof + n + 6
        self._jaw_dofs = slice(dof, dof + jaws)
        self._jaw_q: Vector = data.qpos[q : q + jaws]
        self._jaw_v: Vector = data.qvel[self._jaw_dofs]
        self._jaw_push: Vector = data.qfrc_applied[self._jaw_dofs]
        self._jaw_mass: Vector = model.dof_armature[self._jaw_dofs]
        self._acting: Vector = data.qfrc_constraint[:]
        self.bit = arm_bit(self._number)
        details.never_sleeps(model, int(model.jnt_bodyid[numbers.hinge]))
        details.never_sleeps(model, numbers.gripper)

    def _say(self, what: str, number: int) -> None:
        self.report(harmless(what.format(self.world.parts[number].name)), what == SLIPS)
