"""External wrench and joint torques on the arm, tick by tick: a sum of named contributions.

At the TCP: "applied", "surfaces", "tool" (surfaces on tool and jaws), "parts", "payload" (the difference to
the load that the controller knows). On the joints: "applied", "surfaces", "links" (on each other), "parts".
In free space there are none, and all readings are exactly 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from math import isfinite
from operator import add as add_numbers
from typing import Any

from iiwa_sim.contact.links import LinkContact, Links
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.payload import NO_MOMENTS, Moments, TcpMotion, seen_from, size_of
from iiwa_sim.contact.tcp_contact_kernel import Gaps, TcpContact, TcpState
from iiwa_sim.frames import IDENTITY, Transform, compose, inverse, rotate, transpose
from iiwa_sim.robot.arm_kernel import Tcp
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.model import Model
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

Torques = tuple[float, ...]


class ExternalWrench:
    """Contributions to the external wrench at the TCP, and to the external torques on the joints."""

    def __init__(
        self,
        model: Model,
        tool_in_flange: Transform,
        joints: Sequence[float],
        contact: TcpContact | None = None,
        noise: Noise | None = None,
        tool: Sequence[Capsule] = (),
        base: Transform = IDENTITY,
    ) -> None:
        """Put the robot at rest at joint positions (rad).

        The `tool` is in the flange. `base` is its pose in the world, where weight acts against z.
        """
        self._model, self._base, self.noise = model, base, noise
        self.contact = TcpContact((), 0.0) if contact is None else contact
        """Contact of the TCP with the surfaces; changes of these act from the next tick on."""
        self._links = Links(model, tool)
        self._gaps = self._links.gaps
        self.arm_links = frozenset(capsule.link for capsule in capsules_of(model.description))
        """The names of the links of the arm, without tool and jaws."""
        self.bodies: Any = None
        """Reports the contacts of links with parts; None without parts."""
        self.wrenches: dict[str, Wrench] = {}
        """The contributions at the TCP, along its axes, but for zeros."""
        self.torques: dict[str, Torques] = {}
        """The contributions on the joints (Nm), but for zeros."""
        self._no_torques: Torques = (0.0,) * model.joint_count
        self._pushes: tuple[Wrench, Torques] | None = None
        self._parts_push: Wrench = NO_WRENCH
        self._moments: Moments | None = None
        self._at_tcp = NO_MOMENTS
        self._motion: TcpMotion | None = None
        self._put(joints, tool_in_flange)

    def _put(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        self.tool_in_flange = tool_in_flange
        """Pose of the TCP in the flange."""
        self._tcp = self._model.tcp(tool_in_flange)
        self._coming_tcp = Tcp(self._model.fixed_poses, tool_in_flange)
        self.tcp, self.coming_tcp = self._tcp.pose, self._coming_tcp.pose
        """Return the pose of the TCP in the base at joint positions (rad): of now, and of the next tick."""
        self.levers_m = self._tcp.longest_levers()
        """Greatest distances (m) of the axes of the joints from the TCP, base first."""
        self._joints, self._is_settled = joints, False
        self._links.forget()
        self._surround(joints)
        self._set(self.wrenches, "surfaces", self.contact.begin(self._tcp, joints))

    def _surround(self, joints: Sequence[float]) -> None:
        self._surrounded = self.contact.changes
        self._links.surround(self.contact.surfaces, joints)
        self._take_links()

    def place(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        """Put the robot, with this tool, at rest at joint positions (rad), without any memory of contacts."""
        self.contact.forget()
        self._put(joints, tool_in_flange)
        if self._motion is not None:
            self._motion.rest(self._in_world(self.tcp(joints)))
            self.carry(self._moments, joints)

    def _set(self, contributions: dict[str, Any], name: str, value: tuple[float, ...] | None) -> None:
        """Have a contribution; None or zeros are none."""
        self._pushes = None
        if value is None or value is NO_WRENCH or not any(value):
            contributions.pop(name, None)
        else:
            contributions[name] = value

    def pushes(self) -> tuple[Wrench, Torques]:
        """Return the forces that deflect a compliant robot, besides surfaces at the TCP.

        At the TCP, along its axes: applied wrench, parts, and weight of an unknown payload. On the joints
        (Nm): applied torques, surfaces and parts on links, and links on links.
        """
        if self._pushes is None:
            tcp, found = add(self.wrench, self._parts_push), self._links.forces
            if self._motion is not None:
                tcp = add(tcp, self._motion.wrench(self._at_tcp, moving=False))
            rows = self.joint_push, found.deflecting, found.folded, self.torques.get("parts")
            self._pushes = tcp, _sum([row for row in rows if row is not None])
        return self._pushes

    # Settings

    @property
    def wrench(self) -> Wrench:
        """Wrench applied at the TCP, along its axes. Raises `ValueError` unless set to finite numbers."""
        return self.wrenches.get("applied", NO_WRENCH)

    @wrench.setter
    def wrench(self, wrench: Wrench) -> None:
        self._set(self.wrenches, "applied", _finite(wrench, 6))

    @property
    def joint_push(self) -> Torques:
        """Torque (Nm) applied to each joint. Raises `ValueError` as the wrench does."""
        return self.torques.get("applied", self._no_torques)

    @joint_push.setter
    def joint_push(self, torques: Torques) -> None:
        self._set(self.torques, "applied", _finite(torques, len(self._no_torques)))

    def carry(self, unknown: Moments | None, joints: Sequence[float]) -> None:
        """Carry a payload besides the one that the controller knows, with the arm at joint positions (rad).

        `unknown` are its moments in the flange, less than nothing where the controller believes in more.
        """
        self._moments = unknown
        if unknown is None:
            self._motion, self._at_tcp = None, NO_MOMENTS
            self._set(self.wrenches, "payload", None)
            return
        if self._motion is None:
            self._motion = TcpMotion(self._in_world(self.tcp(joints)))
        self._at_tcp = seen_from(unknown, inverse(self.tool_in_flange))
        self._set(self.wrenches, "payload", self._motion.wrench(self._at_tcp))

    def take_parts(self, wrench: Wrench, push: Wrench, torques: Torques | None) -> None:
        """Take the wrench of parts at the TCP, along its axes, and their torques on the joints (Nm).

        `push` is the part of the wrench that deflects a compliant robot.
        """
        none = wrench is push is self._parts_push is NO_WRENCH
        if none and torques is None and "parts" not in self.torques:
            return
        self._set(self.wrenches, "parts", wrench)
        self._set(self.torques, "parts", torques)
        self._parts_push = push

    def set_jaws(self, jaws: Callable[[], Sequence[Capsule]], moved_m: float) -> None:
        """Have the jaws of a gripper there, in the flange, so much farther out or in than before."""
        self._links.set_jaws(jaws, moved_m)
        self._is_settled = False

    # Ticks

    def _in_world(self, pose: Transform) -> Transform:
        return pose if self._base is IDENTITY else compose(self._base, pose)

    def is_idle(self, joints: Sequence[float], tick: int, tick_s: float) -> bool:
        """Return True if nothing acts in a tick at joint positions (rad), and nothing can begin to."""
        if self.wrenches or self.torques or self.noise is not None or self._motion is not None:
            return False
        if not self.contact.empty or self._surrounded != self.contact.changes:
            return False
        return tick < self._gaps.next or self._gaps.is_free(joints, tick, tick_s)

    @property
    def settled(self) -> bool:
        """True if ticks change only the noise as long as the robot stays where it is."""
        if (self._motion is not None and not self._motion.still) or self._surrounded != self.contact.changes:
            return False
        return self.contact.empty or self._is_settled

    @property
    def foreseen(self) -> tuple[Tcp, TcpContact, Gaps, Any] | None:
        """Data of coming ticks for `leave_out`; None if more acts on the arm than its load."""
        bodies, changed = self.bodies, self._surrounded != self.contact.changes
        if changed or self.torques or self.noise is not None or "applied" in self.wrenches:
            return None
        size = size_of(self._at_tcp, NO_MOMENTS if bodies.moments is None else bodies.moments)
        return self._coming_tcp, self.contact, self._gaps, size

    def leave_out(self, before: Sequence[float], joints: Sequence[float], tick: int, tick_s: float) -> None:
        """Make the tick of this number, from joint positions `before` (rad), after others were left out."""
        self._joints = before
        if self._motion is not None:
            self._motion.step(self.tcp(before), tick_s)
        self.step(joints, tick, tick_s)

    def step(
        self,
        joints: Sequence[float],
        tick: int,
        tick_s: float,
        reached: TcpState | None = None,
        motions: Any = None,
    ) -> None:
        """Make the tick of this number, which has moved the robot to joint positions (rad).

        A compliant motion has found the contact of this tick already; so it is evaluated once. `motions` know
        where the next tick brings the robot.
        """
        if self.noise is not None:
            self.noise.next()
        before, self._joints = self._joints, joints
        if self._motion is not None and not (self._motion.still and joints == before):
            coming = None if motions is None else motions.coming
            ahead = None if coming is None else self._in_world(self.coming_tcp(coming))
            self._motion.step(self._in_world(self.tcp(joints)), tick_s, ahead)
            self._set(self.wrenches, "payload", self._motion.wrench(self._at_tcp))
        if self._surrounded != self.contact.changes:
            self._surround(joints)
        elif self._is_settled and reached is None and joints == before:
            return
        if tick >= self._gaps.next and not self._gaps.is_free(joints, tick, tick_s):
            self._links.step(joints, before, tick, tick_s)
            self._take_links()
        wrench = self.contact.step(self._tcp, joints, tick_s, reached)
        if wrench is NO_WRENCH:
            self.wrenches.pop("surfaces", None)
        else:
            self.wrenches["surfaces"] = wrench
        self._is_settled = self.contact.settled and reached is None and joints == before

    def _take_links(self) -> None:
        """Have the contributions of links, tool and jaws."""
        found, wrench = self._links.forces, NO_WRENCH
        if found.tool is not None:
            rotation, (x, y, z) = self._tcp.pose(self._joints)
            fx, fy, fz, tx, ty, tz = found.tool
            about_tcp = (tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx))
            back = transpose(rotation)
            wrench = (*rotate(back, (fx, fy, fz)), *rotate(back, about_tcp))
        self._set(self.torques, "surfaces", found.torques)
        self._set(self.torques, "links", found.folded)
        self._set(self.wrenches, "tool", wrench)

    def kept(self) -> Any:
        """Return the memory of all contacts, with their forces."""
        return self.contact.memory(), self._links.memory(), dict(self.wrenches), dict(self.torques)

    def restore(self, kept: Any) -> None:
        """Continue from such a memory, with the robot put where it was."""
        contact, links, wrenches, torques = kept
        self.contact.restore(contact)
        self._links.restore(links)
        self.wrenches, self.torques, self._pushes = dict(wrenches), dict(torques), None
        if self._motion is not None:  # it rests
            self._set(self.wrenches, "payload", self._motion.wrench(self._at_tcp))

    # Readings

    @property
    def link_contacts(self) -> tuple[LinkContact, ...]:
        """Links, tool and jaws that have touched surfaces or parts in the last tick."""
        contacts = self._links.forces.contacts
        return contacts if self.bodies is None else (*contacts, *self.bodies.contacts)

    def kind_of(self, name: str) -> str:
        """Return the kind of a body in a contact, by its name: surface, part, body or robot."""
        kinds: dict[str, str] = {} if self.bodies is None else self.bodies.world.kinds
        return kinds.get(name, "surface")

    @property
    def colliding(self) -> tuple[str, str] | None:
        """The names of two links that are in each other."""
        return self._links.forces.colliding

    @property
    def acting(self) -> Wrench:
        """The wrench at the TCP, along its axes, without noise."""
        return reduce(add, self.wrenches.values()) if self.wrenches else NO_WRENCH

    def exact_torques(self, joints: Sequence[float]) -> Torques:
        """Return the external torques (Nm), without noise, with the robot at joint positions (rad)."""
        found = [self._tcp.torques(joints, self.acting)] if self.wrenches else []
        return _sum([*found, *self.torques.values()] or [self._no_torques])

    def cartesian_force(self) -> Wrench:
        """Return the reading of the wrench at the TCP, along its axes."""
        return self.acting if self.noise is None else add(self.acting, self.noise.wrench)

    def joint_torques(self, joints: Sequence[float]) -> Torques:
        """Return the reading of the external torque (Nm) on each joint, with the robot at `joints` (rad)."""
        torques = self.exact_torques(joints)
        return torques if self.noise is None else _sum([torques, self.noise.joint_torques])


def _finite(values: Any, count: int) -> Any:
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"expected {count} finite numbers")
    return values


def _sum(rows: Sequence[Torques]) -> Torques:
    return reduce(lambda a, b: tuple(map(add_numbers, a, b)), rows)
