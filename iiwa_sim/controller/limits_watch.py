"""Limits that are watched in each tick: forces from outside, the TCP's speed and place, collisions of links.

A model of how a robot protects itself, and no safety device.
"""

from collections.abc import Callable, Sequence
from math import dist, hypot, inf
from typing import NamedTuple

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import Vector
from iiwa_sim.wording import harmless

EASE = 1.02
"""A value beyond its limit at a reset may grow by this factor before it stops the robot again."""
NEARLY = 0.999
"""Part of a limit up to which it is surely kept."""
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


class Protection:
    """The limits of one robot, compared with exact values: without the noise of the readings.

    After a reset a quantity may stay beyond its limit, so that the robot can be led out; it may not grow.
    """

    def __init__(self, joints: Sequence[str], torque_limits: Sequence[float], safety: Safety) -> None:
        """Joints by name and with their torque limits (Nm), base first."""
        self._joints = tuple(joints)
        self._torque_limits = tuple(torque_limits)
        self._least_limit = min(torque_limits)
        self._levers_m: object = None
        self._part_per_n = 0.0  # the greatest part of a joint's limit that a force at the TCP can make, per N
        self._allowed: dict[str, float] = {}  # how far beyond its limit a reset has left a quantity
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
        """Stop, in error, when the force or the torque from outside at the TCP is greater; 0 for not watched.

        Raises `Refused` for a threshold (N, Nm) out of range.
        """
        for value, unit in ((force_n, "N"), (torque_nm, "Nm")):
            if value != 0.0 and not LEAST <= value <= GREATEST:
                expected = f"expected 0, for off, or {LEAST:g} to {GREATEST:g} {unit}"
                raise Refused(EXECUTION, f"threshold {value:g} {unit}: {expected}")
        self._watch(self.safety._replace(force_n=force_n or None, torque_nm=torque_nm or None))
        for what in ("force", "torque"):  # it was beyond the limits before
            self._allowed.pop(what, None)
        self._judged = False

    def tolerates(self, load: ExternalWrench) -> bool:
        """Return True if the load is surely within all limits: so in most ticks of a robot in contact."""
        self._judged = load.judged = True
        if load.levers_m is not self._levers_m:
            self._levers_m = load.levers_m
            levers = zip(load.levers_m, self._torque_limits, strict=True)
            self._part_per_n = max(lever / limit for lever, limit in levers)
        x, y, z, a, b, c = load.acting
        force, torque = hypot(x, y, z), hypot(a, b, c)
        if self._allowed or force >= NEARLY * self._most_n or torque >= NEARLY * self._most_nm:
            return False
        for torques in load.torques.values():
            torque += max(map(abs, torques))
        return force * self._part_per_n + torque / self._least_limit < NEARLY

    def knows(self, load: ExternalWrench) -> bool:
        """Return True if another look at the present load would change nothing."""
        return (self._judged and load.judged) or not (load.wrenches or load.torques or self._allowed)

    def overload(self, load: ExternalWrench, joints: Sequence[float], standing: bool) -> str | None:
        """Return why the load at joint positions (rad) stops the robot; None if it does not.

        `standing` says that an error has stopped it before: then the excess is allowed from now on.
        """
        if self.tolerates(load):
            return None
        reasons: list[str] = []
        x, y, z, a, b, c = load.acting
        # Each of them, also behind one that stops the robot: it may not be looked at again before the reset.
        worst = 0.0
        for name, torque, limit in zip(
            self._joints, map(abs, load.exact_torques(joints)), self._torque_limits, strict=True
        ):
            if self._stops(name, torque - limit, standing) and torque / limit > worst:
                worst = torque / limit
                reasons[:] = [f"the external torque on {name} is {torque:.1f} Nm, its limit is {limit:g} Nm"]
        safety = self.safety
        for what, value, unit, threshold in (
            ("force", hypot(x, y, z), "N", safety.force_n),
            ("torque", hypot(a, b, c), "Nm", safety.torque_nm),
        ):
            if threshold is not None and self._stops(what, value - threshold, standing):
                at_tcp = f"the external {what} at the TCP is {value:.1f} {unit}"
                reasons.append(f"collision: {at_tcp}, its threshold is {threshold:g} {unit}")
        # An excess is allowed only as long as it lasts: its end has to be seen.
        self.looks_always = self.watches_tcp or bool(self._allowed)
        return reasons[0] if reasons else None

    def trespass(self, before: Vector, tcp: Vector, tick_s: float, standing: bool) -> str | None:
        """Return why a tick that moved the TCP from `before` to `tcp` (m, in the base) stops the robot."""
        limit, box = self.safety.tcp_speed_m_per_s, self.safety.box
        if limit is not None:
            speed = dist(before, tcp) / tick_s
            if self._stops("speed", speed - limit * (1.0 + ROUNDING), standing):
                return f"the TCP runs at {1e3 * speed:.1f} mm/s, its limit is {1e3 * limit:g} mm/s"
        if box is not None:
            beyond = [max(low - at, at - high) for low, at, high in zip(box[0], tcp, box[1], strict=True)]
            if self._stops("place", max(beyond), standing):
                axis = beyond.index(max(beyond))
                within = f"{1e3 * box[0][axis]:g} to {1e3 * box[1][axis]:g} mm"
                return f"the TCP is at {'xyz'[axis]} {1e3 * tcp[axis]:.1f} mm, its box is {within}"
        return None

    def _stops(self, what: str, excess: float, standing: bool) -> bool:
        """Return True if the robot has to stop: a quantity is so far beyond its limit."""
        if excess <= 0.0:
            self._allowed.pop(what, None)
            return False
        grows = excess > EASE * self._allowed.get(what, 0.0)
        self._allowed[what] = excess if standing or grows else min(excess, self._allowed[what])
        return grows and not standing


def _toucher(load: ExternalWrench, link: str) -> str:
    return f"link {link}" if link in load.arm_links else NAMED.get(link, link)


def _told(load: ExternalWrench, link: str, other: str) -> str:
    kind = load.kind_of(other)
    return f"{_toucher(load, link)} touches {other if kind == 'robot' else f'{kind} {other!r}'}"


def body_touched(load: ExternalWrench) -> str:
    """Return, after a semicolon, which other robot or body of the scene the arm touches; empty for none."""
    for link, other, *_ in load.link_contacts if load.bodies is not None else ():
        if load.kind_of(other) in ("robot", "body"):
            return f"; {_told(load, link, other)}"
    return ""


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
                self._tell(harmless(_told(self._load, link, surface)))
            self.touching = touching
        if moved and tick % self.every == 0:
            folded = self._load.colliding
            if folded is not None and folded != self._folded:
                self._tell(f"links {folded[0]} and {folded[1]} collide")
            self._folded = folded
