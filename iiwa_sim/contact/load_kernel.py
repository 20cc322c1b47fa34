"""The external load on the arm, tick by tick: contacts, and what is carried; `acting_kernel` reads it."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot
from typing import Any, NamedTuple

import cython

from iiwa_sim.contact.at_tcp_kernel import seen_from, velocity_between
from iiwa_sim.contact.itself_kernel import Itself
from iiwa_sim.contact.link_forces_kernel import PARTS, SURFACES, LinkContact
from iiwa_sim.contact.links_kernel import Links, Worn
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.world_kernel import AT_REST
from iiwa_sim.frames import Transform
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.model import Model
from iiwa_sim.wrench import NO_WRENCH, TcpContact, Wrench

if not cython.compiled:
    from iiwa_sim.contact.acting_kernel import Acting
    from iiwa_sim.contact.world_kernel import World
    from iiwa_sim.robot.tcp_kernel import Tcp
else:
    from cython.cimports.iiwa_sim.contact.acting_kernel import Acting  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.contact.world_kernel import World  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.robot.tcp_kernel import Tcp  # type: ignore[no-redef]


class Felt(NamedTuple):
    """What a robot at rest feels of all that it touches, and what that remembers of it."""

    world: object
    links: object
    parts: dict[str, Surface]
    wrenches: tuple[Wrench, Wrench]
    """Of surfaces at the TCP, and on tool and jaws."""
    torques: tuple[tuple[float, ...] | None, tuple[float, ...] | None]
    """Of surfaces on links, and of links on links."""


NEVER = -1
"""Stands for a number of changes of the world that no world has."""


@cython.cclass
class ExternalLoad(Acting):
    """The external load, found tick by tick; exactly 0 in free space.

    A wrench at the TCP and a torque on each joint are applied from outside as long as they are set. Surfaces
    are evaluated once per tick, at the TCP and at the links, and so is what is carried without that the
    controller knows. The readings are the sum, with noise if there is any.
    """

    world: World = cython.declare(World, visibility="readonly")
    """The surfaces; changes are felt from the next tick on."""
    looks_at_itself: int = cython.declare(cython.long, visibility="readonly")
    """The tick in which links could meet each other at the earliest."""
    levers_m: tuple[float, ...] = cython.declare(object, visibility="readonly")
    """No joint's axis is farther from the TCP (m), wherever the robot is; base first."""
    _model: Any
    _coming_tcp: Tcp  # each remembers one pose
    _tool: Any  # what is worn
    _jaws: Any
    _parts: Any  # that lie near, by name
    _itself: Any
    _surrounded: Any  # the number of changes of the world that the links know of
    _settled: Any  # and when a tick left all contacts unchanged
    _place: Any  # position of the TCP at the last evaluation of the surfaces
    _joints: Any  # at the last tick

    def __init__(
        self,
        model: Model,
        tool_in_flange: Transform,
        joints: Sequence[float],
        world: World | None = None,
        noise: Noise | None = None,
        tool: Sequence[Capsule] = (),
    ) -> None:
        """The robot is at rest at `joints` (rad), and `tool_in_flange` is the pose of the TCP; the `tool` is
        capsules as in the flange."""
        Acting.__init__(self, model.tcp(tool_in_flange), model.joint_count, noise)
        self._model = model
        self._coming_tcp = Tcp(model.fixed_poses, tool_in_flange)
        self.world = World((), 0.0) if world is None else world
        self._tool = tuple(Worn(capsule, SURFACES + PARTS) for capsule in tool)
        self._jaws = ()
        self._parts = {}
        self._itself = None
        self.looks_at_itself = 0
        self._surrounded = self._settled = NEVER
        self._place = None
        self._joints = ()
        self.levers_m = _longest_levers(self._tcp)
        self._feel(self._tcp.pose(joints), 0.0)

    @property
    def tool_in_flange(self) -> Transform:
        """The pose of the TCP in the flange."""
        pose: Transform = self._tcp.tool_in_flange
        return pose

    def tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base, at joint positions (rad)."""
        pose: Transform = self._tcp.pose(joints)
        return pose

    def coming_tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base in the next tick, at joint positions (rad)."""
        pose: Transform = self._coming_tcp.pose(joints)
        return pose

    @property
    def links(self) -> Links:
        """The links of the arm, as the world meets them."""
        if self._links is None:
            description = self._model.description
            self._links = Links(self._model.tcp_of_flange.fixed, capsules_of(description))
            self._links.wear([*self._tool, *self._jaws])
        links: Links = self._links
        return links

    @property
    def itself(self) -> Itself:
        """The links of the arm, as they meet each other."""
        if self._itself is None:
            description, tool = self._model.description, [each.capsule for each in self._tool]
            fixed, capsules = self._model.tcp_of_flange.fixed, capsules_of(description)
            self._itself = Itself(fixed, capsules, tool, description.home, description.velocity)
        itself: Itself = self._itself
        return itself

    def jaws_are(self, jaws: Sequence[Worn]) -> None:
        """The jaws of a gripper, as in the flange, are there now."""
        before, self._jaws = self._jaws, tuple(jaws)
        if self._links is not None:
            if len(before) == len(self._jaws):
                self._links.rewear([*self._tool, *self._jaws])
            else:
                self._links.wear([*self._tool, *self._jaws])
                self._surrounded = NEVER
        self._settled = NEVER

    def lay(self, parts: Mapping[str, Surface]) -> None:
        """From now on these parts lie near the arm, which feels them with all but the TCP."""
        if dict(parts) != self._parts:
            self._parts = dict(parts)
            self._surrounded = self._settled = NEVER

    def shift(self, name: str, part: Surface, way: Sequence[float]) -> None:
        """A part that lies near has gone that way: dx dy dz (m) in the base, and an angle about z (rad)."""
        self._parts[name] = part
        self._settled = NEVER
        if self._surrounded == self.world.changes:
            self.links.shift(name, part, way)

    def surround(self, joints: Sequence[float]) -> Links:
        """The links, as they know what surrounds them, with the robot at joint positions (rad)."""
        links = self.links
        if self._surrounded != self.world.changes:
            self._surrounded = self.world.changes
            links.surround(self.world.surfaces, joints, self._parts)
        return links

    def look_at_itself(self, joints: Sequence[float], tick: int, tick_s: float) -> None:
        """In this tick links may be in each other, with the robot at `joints` (rad): find what that does, and
        in which tick it may be so again."""
        itself = self.itself
        self.looks_at_itself = tick + itself.watch(joints, tick_s)
        self._folded = itself.torques

    @property
    def link_contacts(self) -> tuple[LinkContact, ...]:
        """The links that surfaces have touched in the last tick."""
        contacts: tuple[LinkContact, ...] = () if self._links is None else self._links.contacts
        return contacts

    @property
    def carries(self) -> bool:
        """Whether the arm carries what the controller does not know of."""
        return self._motion is not None

    @property
    def changes(self) -> bool:
        """Whether a tick may change a reading: it cannot without noise far from surfaces."""
        touches: bool = self._place is not None or not self.world.empty
        return touches or self._noise is not None or self._motion is not None

    def is_idle(self, tick: cython.long) -> bool:
        """Whether nothing acts in the tick of this number, and nothing can begin to."""
        return tick < self.looks_at_itself and not self.acts and not self.changes

    @property
    def settled(self) -> bool:
        """Whether ticks change only the noise as long as the robot stays where it is."""
        if self._motion is not None and not self._motion.still:
            return False
        settled: bool = self._place is None if self.world.empty else self._settled == self.world.changes
        return settled

    def step(
        self,
        joints: Sequence[float],
        tick_s: float,
        contact: TcpContact | None = None,
        coming: Transform | None = None,
    ) -> None:
        """A tick has moved the robot to `joints` (rad): evaluate the surfaces there, and take new noise.

        If a motion has evaluated them in this tick, its result `contact` is used: they are evaluated once per
        tick. The next tick is to bring the TCP to `coming`, as far as that is known.
        """
        if self._noise is not None:
            self._noise.next()
        if self._motion is not None and not (self._motion.still and joints == self._carried_at):
            self._motion.step(self._tcp.pose(joints) if contact is None else contact[0], tick_s, coming)
            self._carried, self._carried_at = self._motion.wrench(self._at_tcp), joints
        if self.world.empty:
            if self._place is not None:
                self._touch, self._place = NO_WRENCH, None
                self._part_links()
            return
        stands = contact is None and joints == self._joints
        if stands and self._settled == self.world.changes:
            return
        self._joints = joints
        self._touch_links(joints, tick_s)
        tcp, touch = (self._tcp.pose(joints), None) if contact is None else contact
        self.world.roll(tcp.rotation)
        if touch is not None:
            self._place, self._settled = tcp.translation, NEVER
            self._touch = seen_from(tcp.rotation, touch)
        elif stands and tcp.translation == self._place:
            before = self.world.memory()
            self._feel(tcp, tick_s)
            self._settled = self.world.changes if self.world.memory() == before else NEVER
        else:
            self._settled = NEVER
            self._feel(tcp, tick_s)

    def place(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        """The robot is at rest at `joints` (rad) with this tool, without any contact history."""
        self._tcp = self._model.tcp(tool_in_flange)
        self._coming_tcp = Tcp(self._model.fixed_poses, tool_in_flange)
        self.levers_m = _longest_levers(self._tcp)
        self.world.forget()
        self._part_links()
        self._folded, self.looks_at_itself = None, 0
        if self._itself is not None:
            self._itself.forget()
        self._place, self._settled = None, NEVER
        self._feel(self._tcp.pose(joints), 0.0)
        if self._motion is not None:
            self._motion.rest(self._tcp.pose(joints))
            self.carry(self._unknown, joints)
            self._carried_at = joints

    def felt(self) -> Felt:
        """What the robot feels of all that it touches."""
        links = None if self._links is None or self._surrounded == NEVER else self._links.kept()
        wrenches, torques = (self._touch, self._met), (self._link_torques, self._folded)
        return Felt(self.world.kept(), links, dict(self._parts), wrenches, torques)

    def feel_again(self, felt: Felt, joints: Sequence[float]) -> None:
        """The robot has been placed at `joints` (rad), where it felt that, among the same surfaces.

        It goes on as if it had been there all the time.
        """
        self.world.restore(felt.world)
        self._joints, self._place = joints, self._tcp.pose(joints).translation
        self._parts = dict(felt.parts)
        if felt.links is not None:
            self._surrounded = NEVER
            links = self.surround(joints)
            links.restore(felt.links, joints)
        self._touch, self._met = felt.wrenches
        self._link_torques, self._folded = felt.torques
        self._settled = NEVER

    @cython.cfunc
    def _touch_links(self, joints: Sequence[float], tick_s: float) -> None:
        """A tick has moved the robot to `joints` (rad): find what surfaces and parts do to its links, and to
        what it wears."""
        links = self.surround(joints)
        links.step(joints, tick_s)
        self._link_torques, self._met = links.torques, NO_WRENCH
        if links.worn is not None:
            fx, fy, fz, tx, ty, tz = links.worn
            rotation, (x, y, z) = self._tcp.pose(joints)
            torque = (tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx))
            self._met = seen_from(rotation, ((fx, fy, fz), torque))

    @cython.cfunc
    def _part_links(self) -> None:
        """No link touches anything, and what is in a surface now has to come out of it to feel it."""
        self._link_torques, self._met, self._surrounded = None, NO_WRENCH, NEVER
        if self._links is not None:
            self._links.forget()

    @cython.cfunc
    def _feel(self, tcp: Transform, tick_s: float) -> None:
        rotation, place = tcp
        velocity = AT_REST if self._place is None else velocity_between(self._place, place, tick_s)
        self._place = place
        self._touch = seen_from(rotation, self.world.feel(place, velocity, tick_s))


def _longest_levers(tcp: Tcp) -> tuple[float, ...]:
    """The arm stretched from each joint's axis on: all translations from there in a row (m), base first."""
    ways = [hypot(*row[9:]) for row in tcp.fixed.tolist()]
    return tuple(sum(ways[joint:]) for joint in range(1, len(ways)))
