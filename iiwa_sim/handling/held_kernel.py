"""A part between jaws that press on it: where it is, what it does to the TCP, and how it slides."""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot
from typing import Any

import cython
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.at_tcp_kernel import velocity_between
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, apply, rotate, transpose
from iiwa_sim.handling.grip import Grasp, on_pads
from iiwa_sim.handling.gripper import Gripper
from iiwa_sim.handling.part import Part
from iiwa_sim.wrench import NO_WRENCH, Wrench, add

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.at_tcp_kernel import farthest, put_together, take
    from cython.cimports.iiwa_sim.contact.tcp_motion_kernel import TcpMotion
    from cython.cimports.iiwa_sim.handling.gripped_kernel import Gripped
    from cython.cimports.iiwa_sim.handling.touching_kernel import Touching
else:
    from iiwa_sim.contact.at_tcp_kernel import farthest, put_together, take
    from iiwa_sim.contact.tcp_motion_kernel import TcpMotion
    from iiwa_sim.handling.gripped_kernel import Gripped
    from iiwa_sim.handling.touching_kernel import Touching

STICKS = 1.002
"""A part that has slid is held against so many times the force at which it began to: else one that is pressed
would creep on for many ticks after the robot has come to rest."""
_STICKS = cython.declare(cython.double, STICKS)
_UPRIGHT = 0.5**0.5
_HALVINGS = cython.declare(cython.Py_ssize_t, 20)  # of a way into a surface that there is no energy for
# So far aside (m) it is asked what is in the springs of surfaces: where they press to.
_ASIDE = cython.declare(cython.double, 1e-8)
Slip = tuple[float, float]
"""How fast a part slides in the jaws, along x and z of the TCP (m/s)."""
Solid = Callable[[], Sequence[Surface]]
"""What a part may touch, put together when it is asked for."""


@cython.cclass
class Held(Gripped):
    """One part, tick by tick. Its middle is between the jaws, and it is turned as it was when they closed.

    The attributes are declared in the .pxd.
    """

    def __init__(
        self, part: Part, in_tcp: Transform, tcp: Transform, gripper: Gripper, tick_s: float
    ) -> None:
        """The TCP is at rest, and the part at a pose in it, which has touched nothing before."""
        Gripped.__init__(self, part, in_tcp, tcp, tick_s)
        self._u = self._w = 0.0
        self.wrench: Wrench = NO_WRENCH
        self.weight: Wrench = NO_WRENCH
        self.quiet = False
        self.upright = abs(self.pose.rotation[8]) >= _UPRIGHT
        self.touching = Touching(part, self.upright)
        self._gripper = gripper
        self._motion = TcpMotion(tcp)
        self._sticks = 1.0
        self._blow: Wrench | None = None

    def catch(self, grasp: Grasp) -> None:
        """The jaws have closed on it in motion: it goes on as it went, and slides, until friction has brought
        it along; across the pads they bring it along at once."""
        tcp, before, velocity = grasp
        self._motion = TcpMotion(before)
        place = apply(before, self.in_tcp.translation)
        taken = velocity_between(place, self.pose.translation, self._tick)
        gone = (velocity[0] - taken[0], velocity[1] - taken[1], velocity[2] - taken[2])
        across: cython.double
        self._u, across, self._w = rotate(transpose(tcp.rotation), gone)
        self._blow = self._at_middle(0.0, self._mass * across / self._tick, 0.0)

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def step(self, tcp: Transform, coming: Transform | None, solid: Solid) -> cython.bint:
        """A tick has brought the TCP there, from where the next one is to bring it to `coming`, if that is
        known. Says whether the jaws still hold it."""
        motion, touching = self._motion, self.touching
        kept = (self.pose, self.wrench, touching.memory()) if motion.still else None
        spare: Any = self._was
        self._was: Any = self._tcp
        self._tcp: Any = spare
        self._was_x, self._was_z = self._in[9], self._in[11]
        motion.go_to(tcp, self._tick, coming)
        for k in range(12):
            self._tcp[k] = motion._now[k]
        self._placed, self._pose = False, None
        if not touching.passes(farthest(self._was, self._tcp, self._reach)):
            self._place()
            touching.go_to(self._at, solid, self._tick)
        motion.weigh(self._moments)
        motion.act(self._moments)
        self.weight = (motion.gx, motion.gy, motion.gz, motion.hx, motion.hy, motion.hz)
        holds: cython.bint = self._hold()
        self.quiet = kept is not None and motion.still and kept == (self.pose, self.wrench, touching.memory())
        return holds

    def look_again(self) -> None:
        """Surfaces may have come, moved or gone."""
        self.touching.look_again()
        self.quiet = False

    def rest(self, tcp: Transform, solid: Solid, slip: Slip = (0.0, 0.0)) -> None:
        """Take the part as put where it is, with the TCP at rest: it weighs, and is pressed."""
        motion = self._motion
        take(tcp, self._tcp)
        self._stay()
        self._u, self._w = slip
        self._blow, self.quiet, self._pose = None, False, None
        motion.rest(tcp)
        self.touching.forget()
        self._place()
        self.touching.go_to(self._at, solid, self._tick)
        motion.weigh(self._moments)
        self.weight = (motion.gx, motion.gy, motion.gz, motion.hx, motion.hy, motion.hz)
        self.wrench = self.weight
        if self.touching.is_pushed():
            self._press()
            self.wrench = add(self.weight, (self._px, self._py, self._pz, self._qx, self._qy, self._qz))
        x, y, z = self.wrench[0], self.wrench[1], self.wrench[2]
        load: cython.double = hypot(x, z)
        most = self._most()
        if load > most:  # more is not held: it slides from the next tick on
            share = most / load
            self.wrench = self._at_middle(share * x, y, share * z)

    def felt(self) -> object:
        """What it touches, at rest, and what both remember of that; and what it does to the TCP."""
        return self.touching.kept(), self.wrench, self.weight, self._sticks

    def feel_again(self, felt: Any) -> None:
        """Go on touching what `felt` kept, as if the part had been there all the time."""
        touching, self.wrench, self.weight, self._sticks = felt
        self.touching.restore(touching)

    @property
    def slip(self) -> Slip:
        """How fast it slides in the jaws."""
        return (self._u, self._w)

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _most(self) -> cython.double:
        """The greatest force (N) along the pads that the jaws hold by friction."""
        force: cython.double = self._gripper.jaws.force_n
        return 2.0 * cython.cast(cython.double, self.part.friction) * force

    @cython.cfunc
    @cython.exceptval(check=False)
    def _press(self) -> cython.void:
        """Find what surfaces do to it, as the TCP has it."""
        r, t = self._tcp, self.touching
        fx: cython.double = r[0] * t.fx + r[3] * t.fy + r[6] * t.fz
        fy: cython.double = r[1] * t.fx + r[4] * t.fy + r[7] * t.fz
        fz: cython.double = r[2] * t.fx + r[5] * t.fy + r[8] * t.fz
        tx: cython.double = r[0] * t.tx + r[3] * t.ty + r[6] * t.tz
        ty: cython.double = r[1] * t.tx + r[4] * t.ty + r[7] * t.tz
        tz: cython.double = r[2] * t.tx + r[5] * t.ty + r[8] * t.tz
        x, y, z = self._in[9], self._in[10], self._in[11]
        self._px, self._py, self._pz = fx, fy, fz
        self._qx, self._qy, self._qz = tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def _hold(self) -> cython.bint:
        """The jaws hold by friction what they can of what acts on it, without surfaces and by them; what is
        more makes it slide. Says whether they hold it."""
        m = self._motion
        # What it would do to the jaws.
        fx, fy, fz, tx, ty, tz = m.fx, m.fy, m.fz, m.tx, m.ty, m.tz
        if self.touching.is_pushed():
            self._press()
            fx, fy, fz = fx + self._px, fy + self._py, fz + self._pz
            tx, ty, tz = tx + self._qx, ty + self._qy, tz + self._qz
        u, w, most = self._u, self._w, self._most()
        load: cython.double = sqrt(fx * fx + fz * fz)
        if u == 0.0 and w == 0.0 and load <= self._sticks * most:
            if load < most / _STICKS:
                self._sticks = 1.0
            self.wrench = (fx, fy, fz, tx, ty, tz)
            if self._blow is not None:
                self.wrench, self._blow = add(self.wrench, self._blow), None
            return True
        # Friction is what would hold it, and no more than it can be: along the way on which it would go on
        # without friction, or the direction would turn from tick to tick.
        gain: cython.double = self._tick / self._mass
        on_u: cython.double = u + gain * fx
        on_w: cython.double = w + gain * fz
        speed: cython.double = hypot(on_u, on_w)
        dx: cython.double = on_u / speed if speed > 0.0 else 0.0
        dz: cython.double = on_w / speed if speed > 0.0 else 0.0
        friction: cython.double = speed / gain if speed <= self._sticks * gain * most else most
        self.wrench = self._at_middle(friction * dx, fy, friction * dz)
        if self._blow is not None:  # jaws have closed on it in this tick, which it has not slid in
            self.wrench, self._blow = add(self.wrench, self._blow), None
            return True
        left: cython.double = max(0.0, speed - gain * friction) if friction == most else 0.0
        self._sticks = _STICKS
        self._slide(left * dx, left * dz, m.fx - friction * dx, m.fz - friction * dz)
        held: cython.bint = on_pads(self.part, self.in_tcp, self._gripper.jaws)
        return held

    @cython.cfunc
    def _slide(
        self, u: cython.double, w: cython.double, pull_x: cython.double, pull_z: cython.double
    ) -> object:
        """Slide the part on in the jaws at velocities u and w (m/s), by what pulls it besides surfaces (N),
        along x and z of the TCP: into surfaces no deeper, and then no faster, than there is energy for."""
        x, z, bu, bw = self._in[9], self._in[11], self._u, self._w
        touching, pull = self.touching, (pull_x, pull_z)
        close: cython.bint = len(touching.worlds) > 0 or touching.besides is not None
        touching.slides()
        stored_j: cython.double = 0.0
        if close:
            self._place()
            stored_j = touching.stored_at(self._at)
        self._go(x, z, u, w)
        if close:
            # Only of its way into surfaces there may be too much: along them it goes on as it went.
            nx: cython.double
            nz: cython.double
            nx, nz = self._outward(x, z, u, w)
            into: cython.double = u * nx + w * nz
            was: cython.double = bu * nx + bw * nz
            half_mass: cython.double = 0.5 * self._mass
            along = (u - into * nx, w - into * nz)
            fits = self._fits(x, z, along, (into * nx, into * nz), pull, half_mass * was * was + stored_j)
            if fits is None:
                had_j: cython.double = half_mass * (bu * bu + bw * bw) + stored_j
                fits = self._fits(x, z, (0.0, 0.0), along, pull, had_j)
            if fits is None:
                self._go(x, z, 0.0, 0.0)
                u, w = 0.0, 0.0
            else:
                u, w = fits
        self._u, self._w = u, w
        self._in_tcp = None
        self._shift()
        return None

    @cython.cfunc
    def _fits(
        self, x: cython.double, z: cython.double, besides: Any, way: Any, pull: Any, had_j: cython.double
    ) -> object:
        """How fast (m/s) it goes on from a place in the TCP, besides what is given, on as much of a way as
        there is energy for, had_j and what `pull` (N) does; None if there is for none of it."""
        u: cython.double
        w: cython.double
        bu: cython.double
        bw: cython.double
        pull_x: cython.double
        pull_z: cython.double
        u, w = way
        bu, bw = besides
        pull_x, pull_z = pull
        for _ in range(_HALVINGS):
            self._go(x, z, bu + u, bw + w)
            self._place()
            left_j: cython.double = had_j + (pull_x * u + pull_z * w) * self._tick
            left_j -= self.touching.stored_at(self._at)
            if left_j >= 0.0:
                moves_j: cython.double = 0.5 * self._mass * (u * u + w * w)
                share: cython.double = sqrt(min(1.0, left_j / moves_j)) if moves_j > 0.0 else 1.0
                return bu + share * u, bw + share * w
            u, w = 0.5 * u, 0.5 * w
        return None

    @cython.cfunc
    def _outward(self, x: cython.double, z: cython.double, u: cython.double, w: cython.double) -> object:
        """Where surfaces press it to, along x and z of the TCP, of length 1: where it goes, else where it was
        before; its way where they press at neither."""
        gx: cython.double = 0.0
        gz: cython.double = 0.0
        for px, pz in ((self._in[9], self._in[11]), (x, z)):
            if gx == 0.0 and gz == 0.0:
                gx = self._stored_j(px - _ASIDE, pz) - self._stored_j(px + _ASIDE, pz)
                gz = self._stored_j(px, pz - _ASIDE) - self._stored_j(px, pz + _ASIDE)
        if gx == 0.0 and gz == 0.0:
            gx, gz = u, w
        length: cython.double = hypot(gx, gz)
        return (gx / length, gz / length) if length > 0.0 else (0.0, 0.0)

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _stored_j(self, x: cython.double, z: cython.double) -> cython.double:
        """What is in the springs of surfaces (J) where it is at x and z in the TCP."""
        for k in range(9):
            self._aside[k] = self._in[k]
        self._aside[9], self._aside[10], self._aside[11] = x, self._in[10], z
        put_together(self._tcp, self._aside, self._there)
        return self.touching.stored_at(self._there)
