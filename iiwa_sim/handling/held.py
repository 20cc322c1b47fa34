"""A part between jaws that press on it: where it is, what it does to the TCP, and how it slides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import dist, hypot, sqrt
from typing import Any, NamedTuple

from iiwa_sim.contact.at_tcp_kernel import farthest_way, velocity_between
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_motion_kernel import TcpMotion
from iiwa_sim.frames import Transform, Vector, apply, compose, rotate, transpose
from iiwa_sim.handling.grip import grip_width, on_pads
from iiwa_sim.handling.gripper import Gripper
from iiwa_sim.handling.part import Part, X, Y, Z
from iiwa_sim.handling.touching import Touching
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

STICKS = 1.002
"""A part that has slid is held against so many times the force at which it began to: else one that is pressed
would creep on for many ticks after the robot has come to rest."""
_UPRIGHT = 0.5**0.5
_HALVINGS = 20
"""Of a way into a surface that there is no energy for."""
_ASIDE_M = 1e-8
"""So far aside it is asked what is in the springs of surfaces: where they press to."""
Slip = tuple[float, float]
"""How fast a part slides in the jaws, along x and z of the TCP (m/s)."""
Solid = Callable[[], Sequence[Surface]]
"""What a part may touch, put together when it is asked for."""


class Grasp(NamedTuple):
    """Where the TCP has been when the jaws closed on a part, and how that moved."""

    tcp: Transform
    before: Transform
    """In the tick before."""
    velocity: Vector
    """Of the part (m/s), in the base."""


class Held:
    """One part, tick by tick. Its middle is between the jaws, and it is turned as it was when they closed."""

    def __init__(
        self, part: Part, in_tcp: Transform, tcp: Transform, gripper: Gripper, tick_s: float
    ) -> None:
        """The TCP is at rest, and the part at a pose in it, which has touched nothing before."""
        self.part = part
        x, _, z = in_tcp.translation
        self.in_tcp = Transform(in_tcp.rotation, (x, 0.0, z))
        self._pose: Transform | None = None  # until it is asked for
        self._tcp = tcp
        self.width_m = grip_width(part, self.in_tcp)
        self.slip: Slip = (0.0, 0.0)
        self.wrench: Wrench = NO_WRENCH
        """What it does to the TCP, along its axes."""
        self.weight: Wrench = NO_WRENCH
        """Of that its weight alone."""
        self.quiet = False
        """The last tick has changed nothing."""
        self.upright = abs(self.pose.rotation[8]) >= _UPRIGHT
        """Whether a cylinder touches with its rims."""
        self.touching = Touching(part, self.upright)
        self._gripper = gripper
        self._tick_s = tick_s
        self._motion = TcpMotion(tcp)
        self._moments = part.moments(self.in_tcp)
        self._before = tcp, self.in_tcp  # a tick ago
        self._reach_m = self._reaches()
        self._sticks = 1.0  # `STICKS` where it has slid
        self._blow: Wrench | None = None  # of jaws that have closed in motion, in this tick

    def catch(self, grasp: Grasp) -> None:
        """The jaws have closed on it in motion: it goes on as it went, and slides, until friction has brought
        it along; across the pads they bring it along at once."""
        tcp, before, velocity = grasp
        self._motion = TcpMotion(before)
        place = apply(before, self.in_tcp.translation)
        taken = velocity_between(place, self.pose.translation, self._tick_s)
        gone = (velocity[0] - taken[0], velocity[1] - taken[1], velocity[2] - taken[2])
        u, across, w = rotate(transpose(tcp.rotation), gone)
        self.slip = (u, w)
        self._blow = self._at_middle(0.0, self.part.mass_kg * across / self._tick_s, 0.0)

    def step(self, tcp: Transform, coming: Transform | None, solid: Solid) -> bool:
        """A tick has brought the TCP there, from where the next one is to bring it to `coming`, if that is
        known. Says whether the jaws still hold it."""
        motion, touching, was = self._motion, self.touching, self._tcp
        kept = (self.pose, self.wrench, touching.memory()) if motion.still else None
        self._before, self._tcp, self._pose = (was, self.in_tcp), tcp, None
        motion.step(tcp, self._tick_s, coming)
        if not touching.passes(farthest_way(was, tcp, self._reach_m)):
            touching.step(self.pose, solid, self._tick_s)
        self.weight = weight = motion.weight(self._moments)
        free = motion.wrench(self._moments, weight)
        holds = self._hold(free, self._pressed() if touching.pushed else NO_WRENCH)
        self.quiet = kept is not None and motion.still and kept == (self.pose, self.wrench, touching.memory())
        return holds

    def stays(self, tcp: Transform, coming: Transform | None) -> bool:
        """Whether the TCP is where it has been, and stays there as far as is known."""
        return tcp == self._tcp and (coming is None or coming == tcp)

    def look_again(self) -> None:
        """Surfaces may have come, moved or gone."""
        self.touching.look_again()
        self.quiet = False

    def rest(self, tcp: Transform, solid: Solid, slip: Slip = (0.0, 0.0)) -> None:
        """It has been put where it is, with the TCP at rest: it weighs, and is pressed."""
        self._tcp, self.slip, self._blow, self.quiet = tcp, slip, None, False
        self._pose, self._before = None, (tcp, self.in_tcp)
        self._motion.rest(tcp)
        self.touching.forget()
        self.touching.step(self.pose, solid, self._tick_s)
        self.weight = self._motion.weight(self._moments)
        needed = add(self.weight, self._pressed()) if self.touching.pushed else self.weight
        load = hypot(needed[X], needed[Z])
        self.wrench = needed
        if load > self._most:  # more is not held: it slides from the next tick on
            share = self._most / load
            self.wrench = self._at_middle(share * needed[X], needed[Y], share * needed[Z])

    def felt(self) -> object:
        """What it touches, at rest, and what that remembers of it; and what it does to the TCP."""
        return self.touching.kept(), self.wrench, self.weight

    def feel_again(self, felt: Any) -> None:
        """It goes on touching that, where it is, as if it had been there all the time."""
        touching, self.wrench, self.weight = felt
        self.touching.restore(touching)

    @property
    def pose(self) -> Transform:
        """Of its middle, in the base; the same object until it has moved."""
        if self._pose is None:
            self._pose = compose(self._tcp, self.in_tcp)
        return self._pose

    def way_since(self, tcp: Transform, in_tcp: Transform, now: Transform) -> float:
        """No point of it has gone farther (m) since it was at `in_tcp` in the TCP, from where that was to
        where it is `now`."""
        way_m = farthest_way(tcp, now, self._reach_m)
        return way_m if in_tcp is self.in_tcp else way_m + dist(in_tcp.translation, self.in_tcp.translation)

    def _reaches(self) -> float:
        """No point of it is farther from the TCP (m)."""
        return hypot(*self.in_tcp.translation) + self.part.shape.extent

    @property
    def velocity(self) -> Vector:
        """Of its middle in the last tick (m/s), in the base."""
        tcp, in_tcp = self._before
        return velocity_between(apply(tcp, in_tcp.translation), self.pose.translation, self._tick_s)

    @property
    def _most(self) -> float:
        """The greatest force (N) along the pads that the jaws hold by friction."""
        return 2.0 * self.part.friction * self._gripper.jaws.force_n

    def _at_middle(self, fx: float, fy: float, fz: float) -> Wrench:
        """A force (N) at its middle, as the TCP has it."""
        x, y, z = self.in_tcp.translation
        return (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)

    def _pressed(self) -> Wrench:
        """What surfaces do to it, as the TCP has it."""
        turn = transpose(self._tcp.rotation)
        fx, fy, fz = rotate(turn, self.touching.force)
        tx, ty, tz = rotate(turn, self.touching.torque)
        x, y, z = self.in_tcp.translation
        return (fx, fy, fz, tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx)

    def _hold(self, free: Wrench, pressed: Wrench) -> bool:
        """The jaws hold by friction what they can of what acts on it, without surfaces and by them; what is
        more makes it slide. Says whether they hold it."""
        needed = free if pressed is NO_WRENCH else add(free, pressed)  # what it would do to the jaws
        u, w = self.slip
        load, most = hypot(needed[X], needed[Z]), self._most
        if u == w == 0.0 and load <= self._sticks * most:
            if load < most / STICKS:
                self._sticks = 1.0
            self.wrench = needed if self._blow is None else add(needed, self._blow)
            self._blow = None
            return True
        # Friction is what would hold it, and no more than it can be: along the way on which it would go on
        # without friction, or the direction would turn from tick to tick.
        gain = self._tick_s / self.part.mass_kg
        on_u, on_w = u + gain * needed[X], w + gain * needed[Z]
        speed = hypot(on_u, on_w)
        dx, dz = (on_u / speed, on_w / speed) if speed > 0.0 else (0.0, 0.0)
        friction = speed / gain if speed <= self._sticks * gain * most else most
        self.wrench = self._at_middle(friction * dx, needed[Y], friction * dz)
        if self._blow is not None:  # jaws have closed on it in this tick, which it has not slid in
            self.wrench, self._blow = add(self.wrench, self._blow), None
            return True
        left = max(0.0, speed - gain * friction) if friction == most else 0.0
        self._sticks = STICKS
        self._slide(left * dx, left * dz, (free[X] - friction * dx, free[Z] - friction * dz))
        return on_pads(self.part, self.in_tcp, self._gripper.jaws)

    def _slide(self, u: float, w: float, pull: tuple[float, float]) -> None:
        """It goes on in the jaws as fast as that (m/s), by what pulls it besides surfaces (N), along x and z
        of the TCP: into surfaces no deeper, and then no faster, than the energy is there for."""
        in_tcp, (bu, bw) = self.in_tcp, self.slip
        close = self.touching.close
        self.touching.slides()
        stored_j = self.touching.stored_j(self.pose) if close else 0.0
        self._go(in_tcp, u, w)
        if close:
            # Only of its way into surfaces there may be too much: along them it goes on as it went.
            nx, nz = self._outward(in_tcp, (u, w))
            into, was = u * nx + w * nz, bu * nx + bw * nz
            half_mass, along = 0.5 * self.part.mass_kg, (u - into * nx, w - into * nz)
            fits = self._fits(in_tcp, along, (into * nx, into * nz), pull, half_mass * was * was + stored_j)
            if fits is None:
                had_j = half_mass * (bu * bu + bw * bw) + stored_j
                fits = self._fits(in_tcp, (0.0, 0.0), along, pull, had_j)
            if fits is None:
                self._go(in_tcp, 0.0, 0.0)
            u, w = (0.0, 0.0) if fits is None else fits
        self.slip, self._reach_m = (u, w), self._reaches()
        self._moments = self.part.moments(self.in_tcp)

    def _go(self, in_tcp: Transform, u: float, w: float) -> None:
        """It is where a tick brings it from there, as fast as that (m/s) along x and z of the TCP."""
        x, y, z = in_tcp.translation
        self.in_tcp = Transform(in_tcp.rotation, (x + u * self._tick_s, y, z + w * self._tick_s))
        self._pose = None

    def _fits(self, in_tcp: Transform, besides: Slip, way: Slip, pull: Slip, had_j: float) -> Slip | None:
        """How fast (m/s) it goes on, besides what is given, on as much of a way as there is energy for, had_j
        and what `pull` (N) does; None if there is for none of it."""
        u, w = way
        for _ in range(_HALVINGS):
            self._go(in_tcp, besides[0] + u, besides[1] + w)
            left_j = had_j + (pull[0] * u + pull[1] * w) * self._tick_s - self.touching.stored_j(self.pose)
            if left_j >= 0.0:
                moves_j = 0.5 * self.part.mass_kg * (u * u + w * w)
                share = sqrt(min(1.0, left_j / moves_j)) if moves_j > 0.0 else 1.0
                return besides[0] + share * u, besides[1] + share * w
            u, w = 0.5 * u, 0.5 * w
        return None

    def _outward(self, before: Transform, way: Slip) -> Slip:
        """Where surfaces press it to, along x and z of the TCP, of length 1: where it goes, else where it was
        `before`; its way where they press at neither."""
        steps = ((_ASIDE_M, 0.0), (0.0, _ASIDE_M))
        less = [0.0, 0.0]
        for in_tcp in (self.in_tcp, before):
            if not any(less):
                less = [self._stored_j(in_tcp, -dx, -dz) - self._stored_j(in_tcp, dx, dz) for dx, dz in steps]
        gx, gz = less if any(less) else way
        length = hypot(gx, gz)
        return (gx / length, gz / length) if length > 0.0 else (0.0, 0.0)

    def _stored_j(self, in_tcp: Transform, dx: float, dz: float) -> float:
        x, y, z = in_tcp.translation
        aside = Transform(in_tcp.rotation, (x + dx, y, z + dz))
        return self.touching.stored_j(compose(self._tcp, aside))
