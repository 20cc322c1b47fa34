"""Limits that are watched in each tick: forces from outside, the TCP's speed and place, collisions of links.

A model of how a robot protects itself, and no safety device.
"""

from collections.abc import Callable, Sequence
from itertools import compress
from math import dist, hypot, inf
from typing import NamedTuple

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.contact.tcp_contact_kernel import surely_within
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import Vector
from iiwa_sim.wording import harmless

EASE = 1.02
"""A value beyond its limit at a reset may grow by this factor before it stops the robot again."""
LEAST, GREATEST = 1e-3, 1e5
"""Least and greatest threshold that can be set (N, Nm): what is less is only ever a slip."""
ROUNDING = 1e-6
"""Part of a speed by which differences of places may be off."""
SELF_COLLISION_EVERY_S = 0.1
"""Time (s, simulated) between two looks at a moving arm for links that are in each other."""
NAMED = {"tip": "the sphere round the TCP"}
"""Names of what is fixed to the flange, as the log has them, where that is not the own name."""


class Safety(NamedTuple):
    """Limits of a robot besides the torques on its joints; None for what is not watched."""

    force_n: float | None = None
    """Greatest force (N) from outside at the TCP."""
    torque_nm: float | None = None
    """Greatest torque (Nm) from outside at the TCP."""
    tcp_speed_m_per_s: float | None = None
    """Greatest speed of the TCP."""
    box: tuple[Vector, Vector] | None = None
    """Least and greatest x y z (m, in the base) of the TCP."""


NOTHING_MORE = Safety()


class _Excess:
    """Decides whether a quantity beyond its limit stops the robot.

    After a reset it may stay beyond, or nobody could lead the robot out; but it may not grow.
    """

    def __init__(self) -> None:
        self.allowed = 0.0
        """How far beyond the limit the quantity may be: 0 but for what a stop has left."""

    def stops(self, excess: float, standing: bool) -> bool:
        """Return True if the robot has to stop: `excess` is how far beyond the limit the quantity is.

        `standing` says that an error has stopped the robot before.
        """
        if standing or excess > self.allowed * EASE:
            self.allowed = excess
            return not standing
        self.allowed = min(self.allowed, excess)
        return False


class Protection:
    """The limits of one robot, compared with exact values: without the noise of the readings."""

    def __init__(self, joints: Sequence[str], torque_limits: Sequence[float], safety: Safety) -> None:
        """Joints by name and with their torque limits (Nm), base first."""
        self._joints = tuple(joints)
        self._torque_limits = tuple(torque_limits)
        self._least_limit = min(torque_limits)
        self._levers_m: object = None
        self._part_per_n = 0.0  # the greatest part of a joint's limit that a force at the TCP can make, per N
        self._torques = tuple(_Excess() for _ in joints)
        self._force, self._moment, self._speed, self._place = (_Excess() for _ in range(4))
        self._allows = False  # an excess that a reset has allowed
        self._judged = False  # by the present limits
        self.watches_tcp = safety.tcp_speed_m_per_s is not None or safety.box is not None
        """True if the speed or the place of the TCP is watched."""
        self.looks_always = self.watches_tcp
        """True if ticks without any push are checked, too."""
        self._watch(safety)

    def _watch(self, safety: Safety) -> None:
        self.safety = safety
        self._most_n, self._most_nm = safety.force_n or inf, safety.torque_nm or inf

    def set_collision_detection(self, force_n: float, torque_nm: float) -> None:
        """Stop, in error, when the force or the torque from outside at the TCP is greater.

        Args:
            force_n: 0 for not watched, or 0.001 to 1e5.
            torque_nm: As the force (Nm).

        Raises:
            Refused: A threshold is out of range.
        """
        for value, unit in ((force_n, "N"), (torque_nm, "Nm")):
            if value != 0.0 and not LEAST <= value <= GREATEST:
                expected = f"expected 0, for off, or {LEAST:g} to {GREATEST:g} {unit}"
                raise Refused(EXECUTION, f"threshold {value:g} {unit}: {expected}")
        self._watch(self.safety._replace(force_n=force_n or None, torque_nm=torque_nm or None))
        self._force, self._moment = _Excess(), _Excess()  # what was allowed was beyond the limits before
        self._judged = False

    def tolerates(self, load: ExternalWrench) -> bool:
        """Return True if the load is surely within all limits: so in most ticks of a robot in contact."""
        self._judged = True
        if load.levers_m is not self._levers_m:
            self._levers_m = load.levers_m
            self._part_per_n = max(
                lever / limit for lever, limit in zip(load.levers_m, self._torque_limits, strict=True)
            )
        load.judged = True
        within = surely_within(
            load.wrenches, load.torques, self._part_per_n, self._least_limit, self._most_n, self._most_nm
        )
        return within and not self._allows

    def knows(self, load: ExternalWrench) -> bool:
        """Return True if another look at the present load would change nothing."""
        return (self._judged and load.judged) or not (load.acts or self._allows)

    def overload(self, load: ExternalWrench, joints: Sequence[float], standing: bool) -> str | None:
        """Return why the load at joint positions (rad) stops the robot; None if it does not."""
        if self.tolerates(load):
            return None
        safety = self.safety
        x, y, z, a, b, c = load.acting
        # All of them, also where one stops it: at rest it is perhaps not looked at again before the reset.
        joint = self._overloaded_joint(load.exact_torques(joints), standing)
        force = _collision(self._force, "force", hypot(x, y, z), "N", safety.force_n, standing)
        torque = _collision(self._moment, "torque", hypot(a, b, c), "Nm", safety.torque_nm, standing)
        self._allows = any(each.allowed for each in (*self._torques, self._force, self._moment))
        # What is allowed is so only as long as it pushes: that it has ceased to has to be seen.
        self.looks_always = self.watches_tcp or self._allows
        return joint or force or torque

    def _overloaded_joint(self, torques: Sequence[float], standing: bool) -> str | None:
        limits, sizes = self._torque_limits, tuple(map(abs, torques))
        excess = (max(0.0, size - limit) for size, limit in zip(sizes, limits, strict=True))
        stops = [watch.stops(more, standing) for watch, more in zip(self._torques, excess, strict=True)]
        if not any(stops):
            return None
        joint = max(compress(range(len(limits)), stops), key=lambda each: sizes[each] / limits[each])
        return (
            f"the external torque on {self._joints[joint]} is {sizes[joint]:.1f} Nm, "
            f"its limit is {limits[joint]:g} Nm"
        )

    def trespass(self, before: Vector, tcp: Vector, tick_s: float, standing: bool) -> str | None:
        """Return why a tick that moved the TCP from `before` to `tcp` (m, in the base) stops the robot."""
        limit, box = self.safety.tcp_speed_m_per_s, self.safety.box
        if limit is not None:
            speed = dist(before, tcp) / tick_s
            if self._speed.stops(max(0.0, speed - limit * (1.0 + ROUNDING)), standing):
                return f"the TCP runs at {1e3 * speed:.1f} mm/s, its limit is {1e3 * limit:g} mm/s"
        if box is not None:
            beyond = [
                max(low - at, at - high, 0.0) for low, at, high in zip(box[0], tcp, box[1], strict=True)
            ]
            if self._place.stops(max(beyond), standing):
                axis = beyond.index(max(beyond))
                within = f"{1e3 * box[0][axis]:g} to {1e3 * box[1][axis]:g} mm"
                return f"the TCP is at {'xyz'[axis]} {1e3 * tcp[axis]:.1f} mm, its box is {within}"
        return None


def _collision(
    watch: _Excess, what: str, value: float, unit: str, limit: float | None, standing: bool
) -> str | None:
    if limit is None or not watch.stops(max(0.0, value - limit), standing):
        return None
    return (
        f"collision: the external {what} at the TCP is {value:.1f} {unit}, its threshold is {limit:g} {unit}"
    )


class LinkWatch:
    """Reports links, and what is fixed to the flange, that begin to touch surfaces or each other."""

    def __init__(self, load: ExternalWrench, tick_s: float, tell: Callable[[str], None]) -> None:
        """`tell` takes one line for each contact that begins."""
        self._load = load
        self._tell = tell
        self.every = max(1, round(SELF_COLLISION_EVERY_S / tick_s))
        """Ticks between two looks at links that may touch each other."""
        self.touching: set[tuple[str, str]] = set()
        """Links that touch surfaces, by the names of both."""
        self._folded: tuple[str, str] | None = None

    def after_tick(self, tick: int, moved: bool) -> None:
        """Look at contacts, and, each `every` ticks, at links of an arm that moved.

        To be called after ticks in which links touch or have touched, and after each `every` of all.
        """
        contacts = self._load.link_contacts
        if contacts or self.touching:
            touching = {(contact.link, contact.surface) for contact in contacts}
            for link, surface in sorted(touching - self.touching):
                who = f"link {link}" if link in self._load.arm_links else NAMED.get(link, link)
                kind = "surface" if surface in self._load.world.surfaces else "part"
                self._tell(harmless(f"{who} touches {kind} {surface!r}"))
            self.touching = touching
        if moved and tick % self.every == 0:
            folded = self._load.colliding
            if folded is not None and folded != self._folded:
                self._tell(f"links {folded[0]} and {folded[1]} collide")
            self._folded = folded
