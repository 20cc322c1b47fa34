"""Limits that are watched in each tick: forces from outside, the TCP's speed and place, touches of links.

A model of how a robot protects itself, and no safety device.
"""

from collections.abc import Callable
from math import hypot, inf
from operator import truediv
from typing import Any, NamedTuple

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.frames import Vector
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.wording import harmless

EASE = 1.02
"""An excess at a reset may grow by this factor before it stops the robot again."""
GREATEST = 1e5
"""Greatest threshold of a cell (N, Nm)."""
ROUNDING = 1e-6
"""Part of a speed by which differences of places may be off."""
TORQUE = "the external torque on {} is {:.1f} Nm, its limit is {:g} Nm"
AT_TCP = (
    "collision: the external force at the TCP is {:.1f} N, its threshold is {:g} N",
    "collision: the external torque at the TCP is {:.1f} Nm, its threshold is {:g} Nm",
)
SPEED = "the TCP runs at {:.1f} mm/s, its limit is {:g} mm/s"
BOX = "the TCP is at {} {:.1f} mm, its box is {:g} to {:g} mm"
NAMED = {"tip": "the sphere round the TCP"}
"""Names in the log of bodies at the flange whose own name says too little."""


class Safety(NamedTuple):
    """Limits of a robot besides the torques on its joints; infinite for quantities that are not watched."""

    force_n: float = inf
    """Greatest force (N) from outside at the TCP."""
    torque_nm: float = inf
    """Greatest torque (Nm) from outside at the TCP."""
    tcp_speed_m_per_s: float = inf
    """Greatest speed of the TCP."""
    box: tuple[Vector, Vector] = ((-inf, -inf, -inf), (inf, inf, inf))
    """Least and greatest x y z (m, in the base) of the TCP."""


NOTHING_MORE = Safety()


class Protection:
    """The limits of one robot, compared with exact values: without the noise of the readings.

    After a reset the robot may stay beyond its limits, to be led out, but no farther than it is.
    """

    def __init__(self, load: ExternalWrench, description: RobotDescription, safety: Safety) -> None:
        self._load, self._joints, self._torque_limits = load, description.joints, description.torque
        self.allowed: dict[str, float] = {}  # excess over each limit that a reset has left
        self.safety = safety
        self._watches_tcp = safety[2:] != NOTHING_MORE[2:]
        self.looks_always = self._watches_tcp
        """True if ticks without any push are checked, too."""
        self.find_harmless()

    def set_collision_detection(self, force_n: float, torque_nm: float) -> None:
        """Stop, in error, when force (N) or torque (Nm) from outside at the TCP is greater; 0 for any."""
        self.safety = self.safety._replace(force_n=force_n or inf, torque_nm=torque_nm or inf)
        self.allowed = {key: each for key, each in self.allowed.items() if key not in AT_TCP}
        self.find_harmless()

    @property
    def collision_detection(self) -> tuple[float, float]:
        """The greatest force (N) and torque (Nm) from outside at the TCP; 0 where it is not watched."""
        force_n, torque_nm = (0.0 if limit == inf else limit for limit in self.safety[:2])
        return force_n, torque_nm

    def find_harmless(self) -> None:
        """Find the harmless load for the present TCP and thresholds."""
        limits, safety = self._torque_limits, self.safety
        most_n = 0.84 / max(map(truediv, self._load.levers_m, limits))
        self.harmless = min(most_n, safety.force_n), min(0.15 * min(limits), safety.torque_nm)
        """A force (N) and a torque (Nm) at the TCP that surely stop no robot, even together."""

    def tolerates(self) -> bool:
        """Return True if the load is surely within all limits: so in most ticks of a robot in contact."""
        most_n, most_nm = self.harmless
        force = torque = 0.0
        for x, y, z, a, b, c in self._load.wrenches.values():
            force += hypot(x, y, z)
            torque += hypot(a, b, c)
        for torques in self._load.torques.values():
            torque += max(map(abs, torques))
        return not self.allowed and force < most_n and torque < most_nm

    def reason_to_stop(
        self, joints: Joints, tcp: Vector, speed_m_per_s: float, is_in_error: bool
    ) -> str | None:
        """Return why the robot, at joints (rad) and TCP (m, in the base), has to stop; None if it need not.

        An error has stopped it before if it `is_in_error`: then the excess is allowed from now on.
        """
        rows, safety = list[tuple[Any, ...]](), self.safety  # limit, excess, and the words with their values
        if not self.tolerates():
            x, y, z, a, b, c = self._load.acting
            torques = map(abs, self._load.exact_torques(joints))
            for name, torque, limit in zip(self._joints, torques, self._torque_limits, strict=True):
                rows.append((name, torque / limit - 1.0, TORQUE, name, torque, limit))
            for words, value, limit in zip(AT_TCP, (hypot(x, y, z), hypot(a, b, c)), safety[:2], strict=True):
                rows.append((words, value / limit - 1.0, words, value, limit))
        if self._watches_tcp:
            limit = safety.tcp_speed_m_per_s
            excess = speed_m_per_s / limit - 1.0 - ROUNDING
            rows.append((SPEED, excess, SPEED, 1e3 * speed_m_per_s, 1e3 * limit))
            for axis, low, at, high in zip("xyz", safety.box[0], tcp, safety.box[1], strict=True):
                rows.append((axis, max(low - at, at - high), BOX, axis, 1e3 * at, 1e3 * low, 1e3 * high))
        before, self.allowed, worst, reason = self.allowed, {}, 0.0, None
        for key, excess, words, *values in rows:
            if excess > 0.0:
                allowed = before.get(key, 0.0)
                grows = excess > EASE * allowed
                self.allowed[key] = excess if grows or is_in_error else min(excess, allowed)
                if grows and not is_in_error and excess > worst:
                    worst, reason = excess, words.format(*values)
        # An excess is allowed only as long as it lasts: its end has to be seen.
        self.looks_always = self._watches_tcp or bool(self.allowed)
        return reason


def touch(load: ExternalWrench, link: str, other: str) -> str:
    """Return the words for a link, or a body at the flange, that touches something."""
    kind, toucher = load.kind_of(other), f"link {link}" if link in load.arm_links else NAMED.get(link, link)
    return harmless(f"{toucher} touches {other if kind == 'robot' else f'{kind} {other!r}'}")


def body_touched(load: ExternalWrench) -> str:
    """Return, after a semicolon, which other robot or body of the scene the arm touches; empty for none."""
    for each in load.link_contacts if load.bodies is not None else ():
        if load.kind_of(each.surface) in ("robot", "body"):
            return f"; {touch(load, each.link, each.surface)}"
    return ""


def report_touches(load: ExternalWrench, before: set[str], report: Callable[[str], None]) -> set[str]:
    """Report links, tool and jaws that begin to touch something; return the lines of all that touch."""
    touching = {touch(load, contact.link, contact.surface) for contact in load.link_contacts}
    if load.colliding is not None:
        touching.add("links {} and {} collide".format(*load.colliding))
    for line in sorted(touching - before):
        report(line)
    return touching
