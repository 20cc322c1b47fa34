"""External wrench and joint torques on the arm, tick by tick: a sum of named contributions.

At the TCP: "applied", "surfaces", "tool" (surfaces on tool and jaws), "parts", "payload" (the difference to
the load that the controller knows). On the joints: "applied", "surfaces", "links" (on each other), "parts".
In free space there are none, and all readings are exactly 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from operator import add as add_numbers
from typing import Any

import numpy as np

from iiwa_sim.contact.links import LinkContact, Links
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.payload import NO_MOMENTS, Moments, TcpMotion, seen_from
from iiwa_sim.contact.tcp_contact_kernel import Gaps, Reached, TcpContact
from iiwa_sim.frames import IDENTITY, Transform, compose, inverse, rotate, transpose
from iiwa_sim.robot.arm_kernel import Tcp
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.model import Model
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

Torques = tuple[float, ...]
NEVER = -1
"""Stands for a number of changes of surfaces that is never reached."""


class ExternalWrench:
    """Contributions to the external wrench at the TCP, and to the external torques on the joints."""

    def __init__(
        self,
        model: Model,
        tool_in_flange: Transform,
        joints: Sequence[float],
        surfaces: TcpContact | None = None,
        noise: Noise | None = None,
        tool: Sequence[Capsule] = (),
        base: Transform = IDENTITY,
    ) -> None:
        """Put the robot at rest.

        Args:
            model: The arm.
            tool_in_flange: Pose of the TCP in the flange.
            joints: Joint positions (rad).
            surfaces: The surfaces of the cell; none by default.
            noise: Noise of the readings; none by default.
            tool: Capsules of the tool, in the flange.
            base: Pose of the base in the world, where weight acts against z.
        """
        self._model, self._base, self.noise = model, base, noise
        self.world = TcpContact((), 0.0) if surfaces is None else surfaces
        """The surfaces; changes act from the next tick on."""
        self._links = Links(model, tool)
        self._gaps = self._links.gaps
        self.arm_links = frozenset(capsule.link for capsule in capsules_of(model.description))
        """The names of the links of the arm, without tool and jaws."""
        self.bodies: Any = None
        """Reports the contacts of links with parts; None without parts."""
        self.judged = False
        """True if limits have been compared with it since something was set."""
        self.wrenches: dict[str, Wrench] = {}
        """The contributions at the TCP, along its axes, but for zeros."""
        self.torques: dict[str, Torques] = {}
        """The contributions on the joints (Nm), but for zeros."""
        self._wrench: Wrench = NO_WRENCH
        self._joint_push: Torques = (0.0,) * model.joint_count
        self._pushes: tuple[Wrench, Torques] | None = None
        self._parts_push: Wrench = NO_WRENCH
        self._handed: Torques | None = None
        self.needs_poses = False
        """True if ticks need poses of the TCP: for an unknown payload."""
        self._moments: Moments | None = None
        self._at_tcp = NO_MOMENTS
        self._motion: TcpMotion | None = None
        self._surrounded = self._settled = NEVER
        self._put(joints, tool_in_flange)

    def _put(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        self.tool_in_flange = tool_in_flange
        """Pose of the TCP in the flange."""
        self._tcp = self._model.tcp(tool_in_flange)
        self._coming_tcp = Tcp(self._model.fixed_poses, tool_in_flange)
        self.levers_m = self._tcp.longest_levers()
        """Greatest distances (m) of the axes of the joints from the TCP, base first."""
        self._joints = joints
        self._set(self.wrenches, "surfaces", self.world.begin(self._tcp, joints))

    def place(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        """Put the robot, with this tool, at rest at joint positions (rad), without any memory of contacts."""
        self.world.forget()
        self._part_links()
        self._settled, self.judged = NEVER, False
        self._put(joints, tool_in_flange)
        if self._motion is not None:
            self._motion.rest(compose(self._base, self._tcp.pose(joints)))
            self.carry(self._moments, joints)

    def _set(self, contributions: dict[str, Any], name: str, value: tuple[float, ...] | None) -> None:
        """Have a contribution; None or zeros are none."""
        self._pushes = None
        if value is None or value is NO_WRENCH or not any(value):
            contributions.pop(name, None)
        else:
            contributions[name] = value

    def pushes(self) -> tuple[Wrench, Torques]:
        """Return what a compliant robot gives way to, besides surfaces at the TCP.

        At the TCP, along its axes: applied wrench, parts, and weight of an unknown payload. On the joints
        (Nm): applied torques, surfaces and parts on links, and links on links.
        """
        if self._pushes is None:
            tcp = self._wrench if self._parts_push is NO_WRENCH else add(self._wrench, self._parts_push)
            if self._motion is not None:
                tcp = add(tcp, self._motion.weight(self._at_tcp))
            joints, found = self._joint_push, self._links.forces
            for more in (found.yielding, found.folded, self.torques.get("parts")):
                if more is not None:
                    joints = tuple(map(add_numbers, joints, more))
            self._pushes = tcp, joints
        return self._pushes

    # What is set from outside

    @property
    def wrench(self) -> Wrench:
        """Wrench applied at the TCP, along its axes.

        Raises `ValueError` if it is set to anything but six finite numbers.
        """
        return self._wrench

    @wrench.setter
    def wrench(self, wrench: Wrench) -> None:
        _check("wrench", wrench, len(NO_WRENCH))
        self._wrench, self.judged = wrench, False
        self._set(self.wrenches, "applied", wrench)

    @property
    def joint_push(self) -> Torques:
        """Torque (Nm) applied to each joint.

        Raises `ValueError` if it is set to anything but a finite number for each joint.
        """
        return self._joint_push

    @joint_push.setter
    def joint_push(self, torques: Torques) -> None:
        _check("joint_push", torques, len(self._joint_push))
        self._joint_push, self.judged = torques, False
        self._set(self.torques, "applied", torques)

    def carry(self, unknown: Moments | None, joints: Sequence[float]) -> None:
        """Carry a payload besides the one that the controller knows, with the arm at joint positions (rad).

        `unknown` are its moments in the flange, less than nothing where the controller believes in more.
        """
        self._moments, self.judged, self.needs_poses = unknown, False, unknown is not None
        if unknown is None:
            self._motion = None
            self._set(self.wrenches, "payload", None)
            return
        if self._motion is None:
            self._motion = TcpMotion(compose(self._base, self._tcp.pose(joints)))
        self._at_tcp = seen_from(unknown, inverse(self.tool_in_flange))
        self._set(self.wrenches, "payload", self._motion.wrench(self._at_tcp))

    def hand(self, wrench: Wrench, push: Wrench, torques: Torques | None) -> None:
        """Take what parts do to the TCP, along its axes, and to the joints (Nm).

        `push` is the part of the wrench that a compliant robot gives way to.
        """
        if wrench is NO_WRENCH and push is NO_WRENCH is self._parts_push and torques is None is self._handed:
            return
        self._handed = torques
        self._set(self.wrenches, "parts", wrench)
        self._set(self.torques, "parts", torques)
        self._parts_push, self.judged = push, False

    def jaws_are(self, jaws: Sequence[Capsule]) -> None:
        """Have the jaws of a gripper there, in the flange."""
        self._links.jaws_are(jaws)
        self._settled = NEVER

    # Poses

    def tcp(self, joints: Sequence[float]) -> Transform:
        """Return the pose of the TCP in the base, at joint positions (rad)."""
        return self._tcp.pose(joints)

    def coming_tcp(self, joints: Sequence[float]) -> Transform:
        """Return the pose of the TCP in the base in the next tick, at joint positions (rad)."""
        return self._coming_tcp.pose(joints)

    # Ticks

    def is_idle(self, joints: Sequence[float], tick: int, tick_s: float) -> bool:
        """Return True if nothing acts in a tick at joint positions (rad), and nothing can begin to."""
        if self.wrenches or self.torques or self.noise is not None or self._motion is not None:
            return False
        if not self.world.empty or self.world.is_known:
            return False
        return tick < self._gaps.next or self._gaps.is_free(joints, tick, tick_s)

    @property
    def settled(self) -> bool:
        """True if ticks change only the noise as long as the robot stays where it is."""
        if self._motion is not None and not self._motion.still:
            return False
        return not self.world.is_known if self.world.empty else self._settled == self.world.changes

    @property
    def foreseen(self) -> tuple[Tcp, TcpContact, Gaps, Any] | None:
        """Data of coming ticks for `leave_out`; None where more acts than what is carried."""
        world, bodies = self.world, self.bodies
        known = not world.is_known if world.empty else self._surrounded == world.changes
        if not known or self.torques or self.noise is not None or any(self._wrench):
            return None
        carried = [] if self._motion is None else [self._at_tcp]
        carried += [] if bodies is None or bodies.moments is None else [bodies.moments]
        return self._coming_tcp, world, self._gaps, np.reshape(carried, (-1, 4, 4))

    def leave_out(self, joints: Sequence[float], before: Transform, tcp: Transform, tick_s: float) -> None:
        """Be where ticks have brought the arm that were left out, the last of them from `before`."""
        self._joints = joints
        if self._motion is not None:
            self._motion.step(before, tick_s)
            self._motion.step(tcp, tick_s)

    def step(
        self,
        joints: Sequence[float],
        tick: int,
        tick_s: float,
        contact: Reached | None = None,
        coming: Transform | None = None,
    ) -> None:
        """Make the tick of this number, which has moved the robot to joint positions (rad).

        A compliant motion has found the `contact` of this tick already; so it is evaluated once. The next
        tick will bring the TCP to `coming`, if that is known.
        """
        if self.noise is not None:
            self.noise.next()
        if self._motion is not None and not (self._motion.still and joints == self._joints):
            coming = None if coming is None else compose(self._base, coming)
            self._motion.step(compose(self._base, self.tcp(joints)), tick_s, coming)
            self._set(self.wrenches, "payload", self._motion.wrench(self._at_tcp))
        before, self._joints, world = self._joints, joints, self.world
        changes: int = world.changes
        if world.empty:
            if world.is_known:
                world.forget()
                self.wrenches.pop("surfaces", None)
                self._part_links()
        elif contact is None and joints == before and self._settled == changes:
            return
        elif self._surrounded != changes:
            self._surrounded = changes
            self._links.surround(world.surfaces, joints)
        if tick >= self._gaps.next and not self._gaps.is_free(joints, tick, tick_s):
            self._links.step(joints, before, tick, tick_s)
            self._take_links()
        if not world.empty:
            wrench = world.step(self._tcp, joints, tick_s, contact)
            if wrench is NO_WRENCH:
                self.wrenches.pop("surfaces", None)
            else:
                self.wrenches["surfaces"] = wrench
            self._settled = changes if world.settled and contact is None and joints == before else NEVER

    def _take_links(self) -> None:
        """Have the contributions of links, tool and jaws."""
        found, wrench = self._links.forces, NO_WRENCH
        if found.worn is not None:
            rotation, (x, y, z) = self._tcp.pose(self._joints)
            fx, fy, fz, tx, ty, tz = found.worn
            about_tcp = (tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx))
            back = transpose(rotation)
            wrench = (*rotate(back, (fx, fy, fz)), *rotate(back, about_tcp))
        self._set(self.torques, "surfaces", found.torques)
        self._set(self.torques, "links", found.folded)
        self._set(self.wrenches, "tool", wrench)

    def _part_links(self) -> None:
        """Have no contact of links; surfaces that they are in push them only after they have been out."""
        self._links.forget()
        self._surrounded = NEVER
        self._take_links()

    def felt(self) -> Any:
        """Return the memory of all contacts."""
        wrenches = {name: each for name, each in self.wrenches.items() if name in ("surfaces", "tool")}
        torques = {name: each for name, each in self.torques.items() if name in ("surfaces", "links")}
        links = None if self._surrounded == NEVER else self._links.memory()
        return self.world.memory(), links, wrenches, torques

    def feel_again(self, felt: Any, joints: Sequence[float]) -> None:
        """Continue from such a memory, with the robot put at these joint positions (rad) again."""
        tcp, links, wrenches, torques = felt
        self.world.restore(tcp)
        self._joints = joints
        if links is not None:
            self._surrounded = self.world.changes
            self._links.surround(self.world.surfaces, joints)
            self._links.restore(links)
        self.wrenches.update(wrenches)
        self.torques.update(torques)
        self._settled, self.judged, self._pushes = NEVER, False, None

    # Readings

    @property
    def link_contacts(self) -> tuple[LinkContact, ...]:
        """Links, tool and jaws that have touched surfaces or parts in the last tick."""
        contacts = self._links.forces.contacts
        return contacts if self.bodies is None else (*contacts, *self.bodies.contacts)

    def kind_of(self, name: str) -> str:
        """Return what has a name that a contact tells: a surface, a part, a body of the scene, or a robot."""
        kinds: dict[str, str] = {} if self.bodies is None else self.bodies.world.kinds
        return kinds.get(name, "surface")

    @property
    def colliding(self) -> tuple[str, str] | None:
        """The names of two links that are in each other."""
        return self._links.forces.colliding

    @property
    def acting(self) -> Wrench:
        """The wrench at the TCP, along its axes, without noise."""
        found = NO_WRENCH
        for wrench in self.wrenches.values():
            found = wrench if found is NO_WRENCH else add(found, wrench)
        return found

    def exact_torques(self, joints: Sequence[float]) -> Torques:
        """Return the external torques (Nm), without noise, with the robot at joint positions (rad)."""
        found: Torques | None = None
        if self.wrenches:
            found = self._tcp.torques(joints, self.acting)
        for torques in self.torques.values():
            found = torques if found is None else tuple(map(add_numbers, torques, found))
        return self._joint_push if found is None else found

    def cartesian_force(self) -> Wrench:
        """Return the reading of the wrench at the TCP, along its axes."""
        return self.acting if self.noise is None else add(self.acting, self.noise.wrench)

    def joint_torques(self, joints: Sequence[float]) -> Torques:
        """Return the reading of the external torque (Nm) on each joint, with the robot at `joints` (rad)."""
        torques = self.exact_torques(joints)
        return torques if self.noise is None else tuple(map(add_numbers, torques, self.noise.joint_torques))


def _check(name: str, values: Sequence[float], count: int) -> None:
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"{name} is {values}, expected {count} finite numbers")
