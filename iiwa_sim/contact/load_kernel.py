"""The external load on the arm, tick by tick: contacts, and what is carried; `acting_kernel` reads it."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython

from iiwa_sim.contact.contact_state import ContactState
from iiwa_sim.contact.itself_kernel import Itself
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.worn import Worn
from iiwa_sim.frames import Transform
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.model import Model
from iiwa_sim.wrench import NO_WRENCH

if not cython.compiled:
    from iiwa_sim.contact.acting_kernel import Acting
    from iiwa_sim.contact.links_kernel import Links
    from iiwa_sim.contact.tcp_touch_kernel import TcpTouch
    from iiwa_sim.contact.world_kernel import World
    from iiwa_sim.robot.arm_kernel import Tcp
    from iiwa_sim.robot.feeling_kernel import Reached
else:
    from cython.cimports.iiwa_sim.contact.acting_kernel import Acting  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.contact.links_kernel import Links  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.contact.tcp_touch_kernel import TcpTouch  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.contact.world_kernel import World  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.robot.feeling_kernel import Reached  # type: ignore[no-redef]


NEVER = -1
"""Stands for a number of changes of the world that no world has."""


@cython.cclass
class ExternalLoad(Acting):
    """The external load, found tick by tick; exactly 0 in free space.

    Surfaces are evaluated once per tick, at the TCP and at the links, and so is what is carried without that
    the controller knows. The attributes are declared in the .pxd.
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
        Acting.__init__(self, model.tcp(tool_in_flange), model.joint_count, noise)
        self._model = model
        self._coming_tcp = Tcp(model.fixed_poses, tool_in_flange)
        self.world = World((), 0.0) if world is None else world
        self._tool = tuple(Worn(capsule) for capsule in tool)
        self._jaws: tuple[Worn, ...] = ()
        fixed, at = model.tcp_of_flange.fixed, model.description
        self.itself = Itself(
            fixed, capsules_of(at), [each.capsule for each in self._tool], at.home, at.velocity
        )
        self.looks_at_itself = 0
        self._surrounded = self._settled = NEVER
        self._at_world = TcpTouch(self.world)
        self._joints: Sequence[float] = ()
        self._coming_joints: Sequence[float] | None = None
        self.levers_m = self._tcp.longest_levers()
        self._put(joints)

    @cython.ccall
    def coming_tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base in the next tick, at joint positions (rad)."""
        self._coming_joints = joints
        pose: Transform = self._coming_tcp.pose(joints)
        return pose

    @cython.ccall
    def tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base, at joint positions (rad)."""
        if joints == self._coming_joints:  # it has come there: the pose is known
            self._tcp, self._coming_tcp, self._coming_joints = self._coming_tcp, self._tcp, None
        pose: Transform = self._tcp.pose(joints)
        return pose

    @property
    def arm_links(self) -> frozenset[str]:
        """The names of the arm's own links, without what it wears."""
        return frozenset(capsule.link for capsule in capsules_of(self._model.description))

    @property
    def links(self) -> Links:
        """The links of the arm, as the world meets them."""
        if self._links is None:
            self._links = Links(self._model.tcp_of_flange.fixed, capsules_of(self._model.description))
            self._links.wear([*self._tool, *self._jaws])
        links: Links = self._links
        return links

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

    @cython.ccall
    def surround(self, joints: Sequence[float]) -> Links:
        """The links, as they know what surrounds them, with the robot at joint positions (rad)."""
        links = self.links
        if self._surrounded != self.world.changes:
            self._surrounded = self.world.changes
            links.surround(self.world.surfaces, joints)
        return links

    @cython.cfunc
    def _look_at_itself(self, joints: Any, tick: cython.long, tick_s: cython.double) -> object:
        """Find what links do to each other, with the robot at `joints` (rad), in a tick in which they may
        touch; and in which tick they may do so again."""
        self.looks_at_itself = tick + self.itself.watch(joints, tick_s)
        self._folded = self.itself.torques
        return None

    @property
    def changes(self) -> bool:
        """Whether a tick may change a reading: it cannot without noise far from surfaces."""
        touches = self._at_world.known or not self.world.empty
        return bool(touches) or self._noise is not None or self._motion is not None

    @property
    def needs_poses(self) -> bool:
        """Whether ticks need poses of the TCP: for an unknown load at the flange, or for bodies."""
        return self._motion is not None or self.bodies is not None

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def is_idle(self, tick: cython.long) -> cython.bint:
        """Whether nothing acts in the tick of this number, and nothing can begin to."""
        return tick < self.looks_at_itself and not self._acts() and not self.changes

    @property
    def settled(self) -> bool:
        """Whether ticks change only the noise as long as the robot stays where it is."""
        if self._motion is not None and not self._motion.still:
            return False
        return bool(not self._at_world.known if self.world.empty else self._settled == self.world.changes)

    @cython.ccall
    def step(
        self,
        joints: Sequence[float],
        tick: cython.long,
        tick_s: cython.double,
        contact: Reached | None = None,
        coming: Transform | None = None,
    ) -> object:
        """The tick of this number has moved the robot to `joints` (rad): find what acts there, and take new
        noise.

        If a motion has evaluated them in this tick, its result `contact` is used: they are evaluated once per
        tick. The next tick is to bring the TCP to `coming`, as far as that is known.
        """
        if tick >= self.looks_at_itself:
            self._look_at_itself(joints, tick, tick_s)
        if self._noise is not None:
            self._noise.next()
        if self._motion is not None and not (self._motion.still and joints == self._carried_at):
            pose: Transform = self.tcp(joints) if contact is None else contact.pose
            self._motion.step(pose, tick_s, coming)
            self._carried, self._carried_at = self._motion.wrench(self._at_tcp), joints
        touch = self._at_world
        if self.world.empty:
            if touch.known:
                self._touch, touch.known = NO_WRENCH, False
                self._part_links()
            return None
        stands = contact is None and joints == self._joints
        if stands and self._settled == self.world.changes:
            return None
        self._joints, self._settled = joints, NEVER
        self._touch_links(joints, tick_s)
        if contact is None:
            touch.go_to(self._tcp, joints)
        else:
            touch.be_at(contact.at)
        touch.roll()
        if contact is not None and contact.felt:
            a = contact.acting
            self._touch = touch.along(a[0], a[1], a[2], a[3], a[4], a[5])
            touch.stay()
        elif stands and touch.stays():
            before = self.world.memory()
            self._touch = touch.feel(tick_s)
            self._settled = self.world.changes if self.world.memory() == before else NEVER
        else:
            self._touch = touch.feel(tick_s)
        return None

    def place(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        """The robot is at rest at `joints` (rad) with this tool, without any contact history."""
        self._tcp = self._model.tcp(tool_in_flange)
        self._coming_tcp = Tcp(self._model.fixed_poses, tool_in_flange)
        self._coming_joints, self.levers_m = None, self._tcp.longest_levers()
        self.world.forget()
        self._part_links()
        self._folded, self.looks_at_itself, self._settled, self.judged = None, 0, NEVER, False
        self.itself.forget()
        self._put(joints)
        if self._motion is not None:
            self._motion.rest(self._tcp.pose(joints))
            self.carry(self._unknown, joints)
            self._carried_at = joints

    def felt(self) -> ContactState:
        """What the robot feels of all that it touches."""
        links = None if self._links is None or self._surrounded == NEVER else self._links.kept()
        wrenches, torques = (self._touch, self._met), (self._link_torques, self._folded)
        return ContactState(self.world.kept(), links, wrenches, torques)

    def feel_again(self, felt: ContactState, joints: Sequence[float]) -> None:
        """The robot has been placed at `joints` (rad), where it felt that, among the same surfaces.

        It goes on as if it had been there all the time.
        """
        self.world.restore(felt.world)
        self._joints = joints
        self._at_world.go_to(self._tcp, joints)
        self._at_world.stay()
        if felt.links is not None:
            self._surrounded = NEVER
            self.surround(joints).restore(felt.links, joints)
        self._touch, self._met = felt.wrenches
        self._link_torques, self._folded = felt.torques
        self._settled, self.judged = NEVER, False

    @cython.cfunc
    def _touch_links(self, joints: Any, tick_s: cython.double) -> object:
        """A tick has moved the robot to `joints` (rad): find what surfaces do to its links, and to
        what it wears."""
        if self._surrounded != self.world.changes:
            self.surround(joints)
        links: Links = self._links
        links.step(joints, tick_s)
        self._link_torques, self._met = links.torques, NO_WRENCH
        worn = links.worn
        if worn is not None:
            at = self._at_world
            at.go_to(self._tcp, joints)
            fx, fy, fz, tx, ty, tz = worn
            x, y, z = at.at[0], at.at[1], at.at[2]
            tx, ty, tz = tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx)
            self._met = at.along(fx, fy, fz, tx, ty, tz)
        return None

    @cython.cfunc
    def _part_links(self) -> object:
        """No link touches anything, and what is in a surface now has to come out of it to feel it."""
        self._link_torques, self._met, self._surrounded = None, NO_WRENCH, NEVER
        if self._links is not None:
            self._links.forget()
        return None

    @cython.cfunc
    def _put(self, joints: Any) -> object:
        """The robot is put at joint positions (rad): find what surfaces do to its TCP."""
        self._at_world.known = False
        self._at_world.go_to(self._tcp, joints)
        self._touch = self._at_world.feel(0.0)
        return None
