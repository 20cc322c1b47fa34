"""The parts of a cell, and the gripper that picks them, tick by tick."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import dist, hypot
from typing import NamedTuple

from iiwa_sim.contact.at_tcp_kernel import velocity_between
from iiwa_sim.contact.moments import NO_MOMENTS
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_motion_kernel import TcpMotion
from iiwa_sim.frames import IDENTITY, Transform, compose, inverse, rotate, transpose
from iiwa_sim.handling.falling import FALLS, GONE, HELD, LIES, STILL, Body, landed, moved, ridden
from iiwa_sim.handling.grip import grip_width, on_pads
from iiwa_sim.handling.gripper import CLOSES, OPENS, Gripper
from iiwa_sim.handling.ground import Ground, ground_of, grounds_of
from iiwa_sim.handling.part import Part, X, Y, Z
from iiwa_sim.handling.touching import Touching
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

_ROUNDING_M = 1e-9
_UPRIGHT = 0.5**0.5


class Parts(NamedTuple):
    """All that is to be kept of the parts at rest."""

    bodies: tuple[Body, ...] = ()
    held: Transform | None = None
    """The pose of the held one in the TCP."""
    slip: tuple[float, float] = (0.0, 0.0)


class Workpieces:
    """What becomes of the parts: they lie, are gripped and carried, slip, fall and come to rest."""

    def __init__(
        self, bodies: Iterable[Body], surfaces: Sequence[Surface], gripper: Gripper, tick_s: float
    ) -> None:
        """Parts where they are at the beginning, and what stands round them."""
        self.bodies = {each.part.name: each for each in bodies}
        self._gripper = gripper
        self._tick_s = tick_s
        self._tcp = IDENTITY
        self._motion: TcpMotion | None = None
        self._held = ""  # the name of the part between the jaws
        self._in_tcp = IDENTITY  # its pose
        self._lost = ""  # the name of a part that they cannot hold until they have opened
        self._slip = (0.0, 0.0)  # how fast it slides in the jaws, along x and z of the TCP (m/s)
        self._touching: Touching | None = None
        self._surfaces = tuple(surfaces)
        self._solid: list[Surface] | None = None  # these, and parts that lie
        self._grounds: list[Ground] | None = None  # level faces of surfaces
        self._quiet = False  # the last tick has changed nothing of the part that is held
        self._lively = {name for name, each in self.bodies.items() if not each.settled}
        self._moments = NO_MOMENTS  # of the held part, in the TCP
        self._velocity = STILL  # of its middle (m/s)
        self.changes = 0
        """How many times a part has been put somewhere."""
        self.wrench: Wrench = NO_WRENCH
        """What the held part does to the TCP, along its axes."""
        self.weight: Wrench = NO_WRENCH
        """Of that its weight alone."""

    @property
    def held(self) -> str:
        """The name of the part that is held, if any."""
        return self._held

    @property
    def width_m(self) -> float:
        """Of what is held, between the jaws; 0 for nothing."""
        return grip_width(self.bodies[self._held].part, self._in_tcp) if self._held else 0.0

    @property
    def settled(self) -> bool:
        """Whether ticks change nothing as long as TCP and jaws stay where they are."""
        return not self._lively and (not self._held or self._quiet)

    def surfaces_are(self, surfaces: Sequence[Surface]) -> None:
        """What stands there from now on: parts ride up with what they lie on, and fall where it goes from
        below them."""
        self._surfaces = tuple(surfaces)
        self._solid = self._grounds = None
        if self._touching is not None:
            self._touching.look_again()
        self._quiet = False
        faces = grounds_of(self._surfaces)
        lying = [each for each in self.bodies.values() if each.state == LIES]
        for each in sorted(lying, key=_height):
            name = each.part.name
            now = ridden(each, faces)
            if now != each:
                self._put(now)
            if now.state != LIES:
                self._lively.add(name)
            elif now.velocity == STILL:
                face = ground_of(name, each.part.shape, now.pose, each.part.stiffness)
                if face is not None:
                    faces.append(face)

    def grip(self, tcp: Transform, was_m: float) -> float:
        """Jaws that were `was_m` apart close to where they are now, with the TCP at this pose: parts between
        them are pushed together, one is held. Gives how far apart the jaws are kept (m), 0 for not at all."""
        self._tcp = tcp
        now_m, seen = self._gripper.opening_m, inverse(tcp)
        for name, each in self.bodies.items():
            reach = each.part.shape.extent + self._gripper.reach_m
            if each.state == GONE or name == self._lost or dist(each.pose[1], tcp[1]) > reach:
                continue
            in_tcp = compose(seen, each.pose)
            y = in_tcp.translation[Y]
            width = grip_width(each.part, in_tcp)
            if 2.0 * abs(y) + width > was_m + _ROUNDING_M or not on_pads(
                each.part, in_tcp, self._gripper.jaws
            ):
                continue
            if now_m <= width:
                self._take(name, in_tcp)
                return width
            over = abs(y) + 0.5 * (width - now_m)
            if over > 0.0:
                self._push(name, each, over if y < 0.0 else -over)
        return 0.0

    def step(self, tcp: Transform) -> None:
        """A tick has brought the TCP there, and the jaws to where they are."""
        before, self._tcp = self._tcp, tcp
        if self._gripper.driven != CLOSES:
            self._lost = ""
        if self._held:
            if self._gripper.driven == OPENS and self._gripper.opening_m > grip_width(
                self.bodies[self._held].part, self._in_tcp
            ):
                self._let_go()
            elif not (self._quiet and tcp == before):
                self._carry(tcp)
        for each in sorted((self.bodies[name] for name in self._lively), key=_height):
            self._move(each.part.name)

    def lose(self) -> None:
        """What is held is lost: it falls, and is not held again before the jaws have opened."""
        self._lost = self._held
        self._let_go()

    def _let_go(self) -> None:
        """What is held goes on as fast as it is."""
        if not self._held:
            return
        name, each = self._held, self.bodies[self._held]
        pressed_into = self._pressed_into(each)
        self._held, self._touching, self._motion = "", None, None
        self.wrench = self.weight = NO_WRENCH
        self._quiet, self._slip = False, (0.0, 0.0)
        self._put(each._replace(state=FALLS, velocity=self._velocity, on=pressed_into))
        self._lively.add(name)

    def _pressed_into(self, held: Body) -> str:
        """The name of the level face into which the held part is pressed from above, if any."""
        touching, (x, y, _) = self._touching, held.pose.translation
        if touching is None or not any(touching.force):
            return ""
        faces = [
            each
            for each in self._grounds_but(held.part.name)
            if each.top > held.bottom and each.has(x, y) and touching.pressed_from_above(each.name)
        ]
        return max(faces, key=lambda each: each.top).name if faces else ""

    def remove(self, name: str) -> None:
        """Take a part away."""
        if name == self._held:
            self._let_go()
        self._put(self.bodies[name]._replace(state=GONE, velocity=STILL, on=""))
        self._lively.discard(name)
        self._unsettle(name)

    def kept(self) -> Parts:
        """All that is to be kept."""
        return Parts(tuple(self.bodies.values()), self._in_tcp if self._held else None, self._slip)

    def restore(self, parts: Parts, tcp: Transform, surfaces: Sequence[Surface]) -> None:
        """Bring that back, among these surfaces, with the TCP at rest at a pose; nothing has been touched
        before."""
        self._held = self._lost = ""
        self._touching, self._motion, self._quiet = None, None, False
        self.wrench = self.weight = NO_WRENCH
        self._tcp = tcp
        self.bodies = {each.part.name: each for each in parts.bodies}
        self.changes += 1
        self._surfaces = tuple(surfaces)
        self._solid = self._grounds = None
        self._lively = {name for name, each in self.bodies.items() if not each.settled}
        for name, each in self.bodies.items():
            if each.state == HELD and parts.held is not None:
                self._take(name, parts.held)
                self._slip = parts.slip
        self._rest()

    def tcp_is(self, tcp: Transform) -> None:
        """The robot has been put somewhere, at rest, and what it holds with it."""
        self._tcp = tcp
        if self._held:
            self._slip = (0.0, 0.0)
            self._set_held(compose(tcp, self._in_tcp))
            self._velocity, self._quiet = STILL, False
            self._rest()

    def _rest(self) -> None:
        """What is held has been put where it is, with the TCP at rest: it weighs, and is pressed."""
        touching, motion = self._touching, self._motion
        if touching is None or motion is None:
            return
        body = self.bodies[self._held]
        motion.rest(self._tcp)
        touching.forget()
        touching.step(body.pose, self._all_solid(), self._tick_s)
        self.weight = motion.weight(self._moments)
        needed = add(self.weight, self._pressed(self._tcp, touching))
        load, most = hypot(needed[X], needed[Z]), self._most(body.part)
        self.wrench = needed
        if load > most:  # more is not held: it slides from the next tick on
            share = most / load
            self.wrench = self._at_middle(share * needed[X], needed[Y], share * needed[Z])

    def _take(self, name: str, in_tcp: Transform) -> None:
        """From now on it is held."""
        each = self.bodies[name]
        x, _, z = in_tcp.translation
        self._held, self._in_tcp = name, Transform(in_tcp.rotation, (x, 0.0, z))
        pose = compose(self._tcp, self._in_tcp)
        self._touching = Touching(each.part, abs(pose.rotation[8]) >= _UPRIGHT)
        self._motion, self._quiet, self._slip = TcpMotion(self._tcp), False, (0.0, 0.0)
        self._moments, self._velocity = each.part.moments(self._in_tcp), STILL
        self._lively.discard(name)
        self._set_held(pose)
        self._unsettle(name)

    def _unsettle(self, name: str) -> None:
        """What lies on a part falls."""
        self._solid = None
        if self._touching is not None:
            self._touching.look_again()
        for other, each in self.bodies.items():
            if each.on == name and each.state == LIES:
                self._put(each._replace(state=FALLS, on=""))
                self._lively.add(other)

    def _push(self, name: str, each: Body, way_m: float) -> None:
        """A jaw pushes a part that is not held, along y of the TCP."""
        r, (x, y, z) = self._tcp.rotation, each.pose.translation
        up = 0.0 if each.state == LIES else way_m * r[7]
        pose = Transform(each.pose.rotation, (x + way_m * r[1], y + way_m * r[4], z + up))
        if each.state == LIES:  # perhaps over an edge
            each = each._replace(state=FALLS, on="")
            self._lively.add(name)
        self._put(each._replace(pose=pose))
        self._unsettle(name)

    def _put(self, body: Body) -> None:
        self.bodies[body.part.name] = body
        self.changes += 1

    def _set_held(self, pose: Transform) -> None:
        self._put(Body(self.bodies[self._held].part, pose, STILL, HELD))

    def _carry(self, tcp: Transform) -> None:
        """A tick of the part that is held."""
        touching, motion = self._touching, self._motion
        if touching is None or motion is None:
            raise RuntimeError("a part is held by nothing")
        each, was_still = self.bodies[self._held], motion.still
        before = (each.pose, self.wrench, touching.memory()) if was_still else None
        motion.step(tcp, self._tick_s)
        pose = compose(tcp, self._in_tcp)
        self._velocity = velocity_between(each.pose.translation, pose.translation, self._tick_s)
        self._set_held(pose)
        touching.step(pose, self._all_solid(), self._tick_s)
        self._hold(each.part, self._pressed(tcp, touching), motion)
        if self._held:
            now = (self.bodies[self._held].pose, self.wrench, touching.memory()) if was_still else None
            self._quiet = motion.still and before is not None and before == now

    def _most(self, part: Part) -> float:
        """The greatest force (N) along the pads that the jaws hold by friction."""
        return 2.0 * part.friction * self._gripper.jaws.force_n

    def _at_middle(self, fx: float, fy: float, fz: float) -> Wrench:
        """A force (N) at the middle of the held part, as the TCP has it."""
        x, y, z = self._in_tcp.translation
        return (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)

    def _hold(self, part: Part, pressed: Wrench, motion: TcpMotion) -> None:
        """The jaws hold by friction what they can; what is more makes the part slide."""
        needed = add(motion.wrench(self._moments), pressed)  # what it would do to the jaws
        self.weight = motion.weight(self._moments)
        load = hypot(needed[X], needed[Z])
        most = self._most(part)
        u, w = self._slip
        if u == w == 0.0 and load <= most:
            self.wrench = needed
            return
        speed = hypot(u, w)
        dx, dz = (u / speed, w / speed) if speed > 0.0 else (needed[X] / load, needed[Z] / load)
        gain = self._tick_s / part.mass_kg
        new_u, new_w = u + gain * (needed[X] - most * dx), w + gain * (needed[Z] - most * dz)
        if speed > 0.0 and new_u * u + new_w * w <= 0.0:
            new_u = new_w = 0.0  # it is caught, for a tick at least
        self._slip = (new_u, new_w)
        (x, y, z), turned = self._in_tcp.translation, self._in_tcp.rotation
        x, z = x + new_u * self._tick_s, z + new_w * self._tick_s
        self._in_tcp = Transform(turned, (x, y, z))
        self._moments = part.moments(self._in_tcp)
        self.wrench = self._at_middle(most * dx, needed[Y], most * dz)
        sx, sy, sz = rotate(self._tcp.rotation, (new_u, 0.0, new_w))
        vx, vy, vz = self._velocity
        self._velocity = (vx + sx, vy + sy, vz + sz)
        self._set_held(compose(self._tcp, self._in_tcp))
        if not on_pads(part, self._in_tcp, self._gripper.jaws):
            self.lose()

    def _pressed(self, tcp: Transform, touching: Touching) -> Wrench:
        """What surfaces do to the held part, as the TCP has it."""
        if not any(touching.force):
            return NO_WRENCH
        turn = transpose(tcp.rotation)
        fx, fy, fz = rotate(turn, touching.force)
        tx, ty, tz = rotate(turn, touching.torque)
        x, y, z = self._in_tcp.translation
        return (fx, fy, fz, tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx)

    def _move(self, name: str) -> None:
        """A tick of a part that falls or slides."""
        each = self.bodies[name]
        after = moved(each, self._grounds_but(name), self._tick_s)
        self._put(after)
        if after.settled:
            self._lively.discard(name)
            self._solid = None
            if self._touching is not None:
                self._touching.look_again()
        if (each.on and after.on != each.on) or after.pose != each.pose:
            self._unsettle(name)

    def _grounds_but(self, name: str) -> list[Ground]:
        if self._grounds is None:
            self._grounds = grounds_of(self._surfaces)
        found = list(self._grounds)
        for other, each in self.bodies.items():
            if other != name and each.state == LIES and each.velocity == STILL:
                ground = ground_of(other, each.part.shape, each.pose, each.part.stiffness)
                if ground is not None:
                    found.append(ground)
        return found

    def _all_solid(self) -> list[Surface]:
        """Surfaces, and parts that lie."""
        if self._solid is None:
            self._solid = list(self._surfaces)
            for name, each in self.bodies.items():
                if each.state == LIES:
                    part = each.part
                    self._solid.append(Surface(name, part.shape, each.pose, part.stiffness, 0.0, 0.0))
        return self._solid


def _height(body: Body) -> tuple[float, str]:
    return body.pose.translation[2], body.part.name


def start(parts: Iterable[tuple[Part, Transform]], surfaces: Sequence[Surface]) -> list[Body]:
    """Parts as they are at the beginning: what stands right above a face lies on it, all else falls."""
    bodies: list[Body] = []
    for part, pose in sorted(parts, key=lambda each: each[1].translation[2]):
        body = Body(part, pose, STILL, FALLS)
        grounds = grounds_of(surfaces)
        for each in bodies:
            ground = ground_of(each.part.name, each.part.shape, each.pose, each.part.stiffness)
            if ground is not None and each.state == LIES:
                grounds.append(ground)
        x, y, z = pose.translation
        below = [each for each in grounds if each.top < z and each.has(x, y)]
        if below:
            top = max(below, key=lambda each: each.top)
            if abs(body.bottom - top.top) <= CLOSE_M:
                body = landed(body, top)
        bodies.append(body)
    return bodies


CLOSE_M = 1e-3
"""What is no farther above a face, or in it, at the beginning, lies on it."""
