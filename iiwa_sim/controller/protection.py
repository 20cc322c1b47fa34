"""A robot that protects itself: what it watches in each tick, and when it stops for that.

A model of what such a robot does, and no safety device.
"""

from collections.abc import Sequence
from itertools import compress
from math import dist, hypot, inf
from typing import NamedTuple

from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.tolerance_kernel import Tolerance
from iiwa_sim.frames import Vector

EASE = 1.02
"""What is beyond its limit when the error is reset may grow by this factor before it stops the robot anew."""
LEAST, GREATEST = 1e-3, 1e5
"""Least and greatest threshold that can be set (N, Nm): what is less is only ever a slip."""
ROUNDING = 1e-6
"""Part of a speed by which differences of places may be off."""


class Safety(NamedTuple):
    """What a robot watches besides the torques on its joints; None for what it does not."""

    force_n: float | None = None
    """Greatest force (N) from outside at the TCP."""
    torque_nm: float | None = None
    """Greatest torque (Nm) from outside at the TCP."""
    tcp_speed_m_per_s: float | None = None
    """Greatest speed of the TCP."""
    box: tuple[Vector, Vector] | None = None
    """Least and greatest x y z (m, in the base) of the TCP."""


NOTHING_MORE = Safety()


class _Watch:
    """Whether a quantity beyond its limit stops the robot.

    After a reset it may stay beyond, or nobody could lead the robot out; but it may not grow.
    """

    def __init__(self) -> None:
        self.allowed = 0.0
        """How far beyond the limit the quantity may be: not at all, but for what a stop has left."""

    def stops(self, excess: float, standing: bool) -> bool:
        """Whether the robot has to stop: `excess` is how far beyond the limit the quantity is, 0 within.

        `standing` says that an error has stopped the robot before.
        """
        if standing or excess > self.allowed * EASE:
            self.allowed = excess
            return not standing
        self.allowed = min(self.allowed, excess)
        return False


class Protection(Tolerance):
    """What one robot watches. All of it is exact: without the noise of the readings."""

    def __init__(self, joints: Sequence[str], torque_limits: Sequence[float], safety: Safety) -> None:
        """Joints by name and with their torque limits (Nm), base first."""
        super().__init__(torque_limits)
        self._joints = tuple(joints)
        self._watch(safety)
        self.watches_tcp = safety.tcp_speed_m_per_s is not None or safety.box is not None
        """Whether the speed or the place of the TCP is watched."""
        self.looks_always = self.watches_tcp
        self._torques = tuple(_Watch() for _ in joints)
        self._force, self._moment, self._speed, self._place = (_Watch() for _ in range(4))

    def _watch(self, safety: Safety) -> None:
        self.safety = safety
        self._most_n, self._most_nm = safety.force_n or inf, safety.torque_nm or inf

    def set_collision_detection(self, force_n: float, torque_nm: float) -> None:
        """Watch the force and the torque from outside at the TCP; 0 for what is not watched.

        Raises `Refused` for what is neither 0 nor a number from 0.001 to 1e5.
        """
        for value, unit in ((force_n, "N"), (torque_nm, "Nm")):
            if value != 0.0 and not LEAST <= value <= GREATEST:
                expected = f"expected 0, for off, or {LEAST:g} to {GREATEST:g} {unit}"
                raise Refused(EXECUTION, f"threshold {value:g} {unit}: {expected}")
        self._watch(self.safety._replace(force_n=force_n or None, torque_nm=torque_nm or None))
        self._force, self._moment = _Watch(), _Watch()  # what was allowed was so beyond the limits before
        self._judged = False

    def knows(self, load: ExternalLoad) -> bool:
        """Whether another look at what is applied now would change nothing."""
        return (self._judged and load.judged) or not (load.acts or self._allows)

    def overload(self, load: ExternalLoad, joints: Sequence[float], standing: bool) -> str | None:
        """Why the load at joint positions (rad) stops the robot; None if it does not."""
        if self.tolerates(load):
            return None
        safety = self.safety
        x, y, z, a, b, c = load.acting
        # All of them, also where one stops it: at rest it is perhaps not looked at again before the reset.
        joint = self._overloaded_joint(load.exact_torques(joints), standing)
        force = _collision(self._force, "force", hypot(x, y, z), "N", safety.force_n, standing)
        torque = _collision(self._moment, "torque", hypot(a, b, c), "Nm", safety.torque_nm, standing)
        self._allows = any(watch.allowed for watch in (*self._torques, self._force, self._moment))
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
        """Why a tick that moved the TCP from `before` to `tcp` (m, in the base) stops the robot, or None."""
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
    watch: _Watch, what: str, value: float, unit: str, limit: float | None, standing: bool
) -> str | None:
    if limit is None or not watch.stops(max(0.0, value - limit), standing):
        return None
    return (
        f"collision: the external {what} at the TCP is {value:.1f} {unit}, its threshold is {limit:g} {unit}"
    )
