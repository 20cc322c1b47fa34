"""The external load on the arm, tick by tick: contacts, and what is carried; `acting` says how it is read."""

from collections.abc import Mapping, Sequence
from math import hypot
from typing import NamedTuple

from iiwa_sim.contact.acting import Acting
from iiwa_sim.contact.at_tcp_kernel import seen_from, velocity_between
from iiwa_sim.contact.itself_kernel import Itself
from iiwa_sim.contact.link_forces_kernel import PARTS, SURFACES, LinkContact
from iiwa_sim.contact.links_kernel import Links, Worn
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.world_kernel import AT_REST, World
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.tcp_kernel import Tcp
from iiwa_sim.wrench import NO_WRENCH, TcpContact, Wrench


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


class ExternalLoad(Acting):
    """The external load, found tick by tick; exactly 0 in free space.

    A wrench at the TCP and a torque on each joint are applied from outside as long as they are set. Surfaces
    are evaluated once per tick, at the TCP and at the links, and so is what is carried without that the
    controller knows. The readings are the sum, with noise if there is any.
    """

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
        super().__init__(model.tcp(tool_in_flange), model.joint_count, noise)
        self._model = model
        self._coming_tcp = model.tcp(tool_in_flange)  # each remembers one pose
        self.world = World((), 0.0) if world is None else world
        """The surfaces; changes are felt from the next tick on."""
        self._tool = tuple(Worn(capsule, SURFACES + PARTS) for capsule in tool)
        self._jaws: tuple[Worn, ...] = ()
        self._parts: dict[str, Surface] = {}  # that lie near
        self._itself: Itself | None = None
        self.looks_at_itself = 0
        """The tick in which links could meet each other at the earliest."""
        self._surrounded = NEVER  # the number of changes of the world that the links know of
        self._place: Vector | None = None  # position of the TCP at the last evaluation of the surfaces
        self._joints: Sequence[float] = ()  # at the last tick
        self._settled = NEVER  # the number of changes of the world when a tick left all contacts unchanged
        self.levers_m = _longest_levers(self._tcp)
        """No joint's axis is farther from the TCP (m), wherever the robot is; base first."""
        self._feel(self._tcp.pose(joints), 0.0)

    @property
    def tool_in_flange(self) -> Transform:
        """The pose of the TCP in the flange."""
        pose: Transform = self._tcp.tool_in_flange
        return pose

    def tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base, at joint positions (rad)."""
        return self._tcp.pose(joints)

    def coming_tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base in the next tick, at joint positions (rad)."""
        return self._coming_tcp.pose(joints)

    @property
    def links(self) -> Links:
        """The links of the arm, as the world meets them."""
        if self._links is None:
            description = self._model.description
            self._links = Links(self._model.tcp_of_flange.fixed, capsules_of(description))
            self._links.wear([*self._tool, *self._jaws])
        return self._links

    @property
    def itself(self) -> Itself:
        """The links of the arm, as they meet each other."""
        if self._itself is None:
            description, tool = self._model.description, [each.capsule for each in self._tool]
            fixed, capsules = self._model.tcp_of_flange.fixed, capsules_of(description)
            self._itself = Itself(fixed, capsules, tool, description.home, description.velocity)
        return self._itself

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
    def acts(self) -> bool:
        """Whether anything pushes the robot: exactly nothing does in free space."""
        return (
            self._pushed
            or self._touch is not NO_WRENCH
            or self._carried is not NO_WRENCH
            or self._link_torques is not None
            or self._folded is not None
            or self._met is not NO_WRENCH
            or self._handed is not NO_WRENCH
        )

    @property
    def changes(self) -> bool:
        """Whether a tick may change a reading: it cannot without noise far from surfaces."""
        return (
            self._noise is not None
            or self._place is not None
            or self._motion is not None
            or not self.world.empty
        )

    @property
    def settled(self) -> bool:
        """Whether ticks change only the noise as long as the robot stays where it is."""
        if self._motion is not None and not self._motion.still:
            return False
        if self.world.empty:
            return self._place is None
        return self._settled == self.world.changes

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
        self._tcp, self._coming_tcp = self._model.tcp(tool_in_flange), self._model.tcp(tool_in_flange)
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

    def _part_links(self) -> None:
        """No link touches anything, and what is in a surface now has to come out of it to feel it."""
        self._link_torques, self._met, self._surrounded = None, NO_WRENCH, NEVER
        if self._links is not None:
            self._links.forget()

    def _feel(self, tcp: Transform, tick_s: float) -> None:
        rotation, place = tcp
        velocity = AT_REST if self._place is None else velocity_between(self._place, place, tick_s)
        self._place = place
        self._touch = seen_from(rotation, self.world.feel(place, velocity, tick_s))


def _longest_levers(tcp: Tcp) -> tuple[float, ...]:
    """The arm stretched from each joint's axis on: all translations from there in a row (m), base first."""
    ways = [hypot(*row[9:]) for row in tcp.fixed.tolist()]
    return tuple(sum(ways[joint:]) for joint in range(1, len(ways)))
