"""What acts on the arm at a moment, and how it is read: forces at the TCP, torques on the joints."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from operator import add as add_numbers
from typing import Any

import cython
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.link_forces_kernel import LinkContact
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.payload import NO_MOMENTS, Moments, TcpMotion, seen_from
from iiwa_sim.frames import Transform, inverse
from iiwa_sim.wrench import NO_WRENCH, Wrench

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp
else:
    from iiwa_sim.robot.arm_kernel import Tcp

_NEARLY = cython.declare(cython.double, 0.999)


@cython.cclass
class Acting:
    """What acts on the arm, kind by kind, and their sum as it is read, with noise if there is any.

    A wrench at the TCP and a torque on each joint are applied from outside as long as they are set. The rest
    is found by whoever moves the arm.
    """

    def __init__(self, tcp: Tcp, joint_count: int, noise: Noise | None) -> None:
        """Nothing acts yet; what the attributes are is said in the .pxd."""
        self._tcp = tcp
        self._noise = noise
        self._wrench: Wrench = NO_WRENCH
        self._joint_push: tuple[float, ...] = (0.0,) * joint_count
        self._pushed = False
        self._joints_pushed = False
        self._touch: Wrench = NO_WRENCH
        self._carried: Wrench = NO_WRENCH
        self._handed: Wrench = NO_WRENCH
        self._handed_push: Wrench = NO_WRENCH
        self._handed_torques: tuple[float, ...] | None = None
        self._met: Wrench = NO_WRENCH
        self._link_torques: tuple[float, ...] | None = None
        self._folded: tuple[float, ...] | None = None
        self._unknown: Moments | None = None
        self._at_tcp = NO_MOMENTS
        self._motion: TcpMotion | None = None
        self._carried_at: Any = ()
        self._links: Any = None
        self.bodies: Any = None
        self.judged = False
        self.pushes = _Pushes(self)

    @property
    def wrench(self) -> Wrench:
        """Wrench applied at the TCP, along its axes.

        Raises `ValueError` if it is set to anything but six finite numbers.
        """
        return self._wrench

    @wrench.setter
    def wrench(self, wrench: Wrench) -> None:
        _check("wrench", wrench, len(NO_WRENCH))
        self._wrench, self.judged = wrench, False
        self._pushed = any(wrench) or self._joints_pushed

    @property
    def joint_push(self) -> tuple[float, ...]:
        """Torque (Nm) applied to each joint.

        Raises `ValueError` if it is set to anything but a finite number for each joint.
        """
        return self._joint_push

    @joint_push.setter
    def joint_push(self, torques: tuple[float, ...]) -> None:
        _check("joint_push", torques, len(self._joint_push))
        self._joint_push, self.judged = torques, False
        self._joints_pushed = any(torques)
        self._pushed = any(self._wrench) or self._joints_pushed

    @property
    def tool_in_flange(self) -> Transform:
        """The pose of the TCP in the flange."""
        pose: Transform = self._tcp.tool_in_flange
        return pose

    @cython.ccall
    def tcp(self, joints: Sequence[float]) -> Transform:
        """The pose of the TCP in the base, at joint positions (rad)."""
        pose: Transform = self._tcp.pose(joints)
        return pose

    @property
    def link_contacts(self) -> tuple[LinkContact, ...]:
        """Links, tool and jaws that have touched surfaces or parts in the last tick."""
        contacts: tuple[LinkContact, ...] = () if self._links is None else self._links.contacts
        return contacts if self.bodies is None else (*contacts, *self.bodies.contacts)

    def carry(self, unknown: Moments | None, joints: Sequence[float]) -> None:
        """The arm, at `joints` (rad), carries this from now on, seen from the flange, besides what the
        controller knows of: None for nothing, and less than nothing where that is less."""
        self._unknown, self.judged = unknown, False
        if unknown is None:
            self._motion, self._carried = None, NO_WRENCH
            return
        if self._motion is None:
            self._motion = TcpMotion(self._tcp.pose(joints))
        self._at_tcp = seen_from(unknown, inverse(self._tcp.tool_in_flange))
        self._carried = self._motion.wrench(self._at_tcp)

    @cython.ccall
    def hand(self, wrench: Wrench, push: Wrench, torques: Any) -> object:
        """What parts do to the TCP, along its axes, in this tick, and to the joints by links (Nm), None for
        nothing; `push` is what of the wrench a robot that yields gives way to."""
        self._handed, self._handed_push, self._handed_torques, self.judged = wrench, push, torques, False
        return None

    @property
    def tcp_push(self) -> Wrench:
        """What a robot that yields gives way to at the TCP, along its axes, besides surfaces: the applied
        wrench, parts, and the weight of what the controller does not know of."""
        push = self._wrench if self._handed is NO_WRENCH else _sum_of(self._wrench, self._handed_push)
        return push if self._motion is None else _sum_of(push, self._motion.weight(self._at_tcp))

    @property
    def folded(self) -> bool:
        """Whether links are in each other."""
        return self._folded is not None

    @property
    def touching(self) -> bool:
        """Whether surfaces have done anything to the robot in the last tick."""
        return self._touch is not NO_WRENCH

    def skip(self, ticks: int) -> None:
        """Count ticks that change only the noise."""
        if self._noise is not None:
            self._noise.next(ticks)

    def seed(self, seed: int) -> None:
        """Restart the noise with this seed, if there is noise."""
        if self._noise is not None:
            self._noise.seed(seed)

    def cartesian_force(self) -> Wrench:
        """The reading of the wrench at the TCP, along its axes."""
        wrench = self.acting
        return wrench if self._noise is None else _sum_of(wrench, self._noise.wrench)

    def joint_torques(self, joints: Sequence[float]) -> tuple[float, ...]:
        """The reading of the external torque (Nm) on each joint, with the robot at `joints` (rad)."""
        torques = self.exact_torques(joints)
        if self._noise is not None:
            torques = tuple(a + b for a, b in zip(torques, self._noise.joint_torques, strict=True))
        return torques

    def readings(self, joints: Sequence[float]) -> tuple[Wrench, tuple[float, ...]]:
        """Both of them, with the robot at `joints` (rad); at once where nothing acts on the TCP."""
        if self._noise is None and not self._acts():  # as in most ticks of a robot that is recorded
            return NO_WRENCH, self._joint_push
        return self.cartesian_force(), self.joint_torques(joints)

    def exact_torques(self, joints: Sequence[float]) -> tuple[float, ...]:
        """The external torque (Nm) on each joint, without noise, with the robot at `joints` (rad).

        Applied torques, those of surfaces on links and of links on links, and the wrench at the TCP by the
        transposed Jacobian.
        """
        wrench, made_by_links = self.acting, self._made_by_links
        if made_by_links is None:
            if not any(wrench):
                return self._joint_push
            made: tuple[float, ...] = self._tcp.torques(joints, wrench)
            return tuple(map(add_numbers, self._joint_push, made)) if self._joints_pushed else made
        pushed = tuple(map(add_numbers, self._joint_push, made_by_links))
        return tuple(map(add_numbers, pushed, self._tcp.torques(joints, wrench))) if any(wrench) else pushed

    @property
    def acts(self) -> bool:
        """Whether anything pushes the robot: exactly nothing does in free space."""
        return bool(self._acts())

    @cython.cfunc
    @cython.exceptval(check=False)
    def _acts(self) -> cython.bint:
        """`acts` for kernels."""
        return (
            self._pushed
            or self._touch is not NO_WRENCH
            or self._carried is not NO_WRENCH
            or self._link_torques is not None
            or self._folded is not None
            or self._met is not NO_WRENCH
            or self._handed is not NO_WRENCH
            or self._handed_torques is not None
        )

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def surely_within(
        self,
        part_per_n: cython.double,
        least_nm: cython.double,
        most_n: cython.double,
        most_nm: cython.double,
    ) -> cython.bint:
        """Whether it is sure that no joint feels more than its limit, and the TCP neither more force (N) nor
        more torque (Nm) than so.

        A force at the TCP makes no more than `part_per_n` of a joint's limit (1/N), no limit is less than
        `least_nm`. What is near a limit is not sure: that takes the torques themselves.
        """
        x: cython.double
        y: cython.double
        z: cython.double
        a: cython.double
        b: cython.double
        c: cython.double
        self.judged = True
        x, y, z, a, b, c = self._sum()
        force: cython.double = sqrt(x * x + y * y + z * z)
        torque: cython.double = sqrt(a * a + b * b + c * c)
        if not (force < _NEARLY * most_n and torque < _NEARLY * most_nm):
            return False
        pushed: cython.double = _greatest(self._joint_push) if self._joints_pushed else 0.0
        if self._link_torques is not None:
            pushed += _greatest(self._link_torques)
        if self._folded is not None:
            pushed += _greatest(self._folded)
        if self._handed_torques is not None:
            pushed += _greatest(self._handed_torques)
        return force * part_per_n + (torque + pushed) / least_nm < _NEARLY

    @property
    def acting(self) -> Wrench:
        """The wrench at the TCP, along its axes, without noise."""
        wrench: Wrench = self._sum()
        return wrench

    @cython.cfunc
    def _sum(self) -> object:
        """`acting` for kernels."""
        wrench = self._wrench
        if self._touch is not NO_WRENCH:
            wrench = self._touch if wrench is NO_WRENCH else _sum_of(self._touch, wrench)
        if self._handed is not NO_WRENCH:
            wrench = _sum_of(wrench, self._handed)
        if self._met is not NO_WRENCH:
            wrench = _sum_of(wrench, self._met)
        return wrench if self._carried is NO_WRENCH else _sum_of(wrench, self._carried)

    @property
    def _made_by_links(self) -> tuple[float, ...] | None:
        """Torques (Nm) of surfaces, parts and links on links; None for neither."""
        made: tuple[float, ...] | None = None
        for each in (self._link_torques, self._folded, self._handed_torques):
            if each is not None:
                made = each if made is None else tuple(map(add_numbers, made, each))
        return made


@cython.cclass
class _Pushes:
    """What pushes a robot that yields, in the form of `iiwa_sim.motion.impedance.Pushes`."""

    _load: Acting

    def __init__(self, load: Acting) -> None:
        self._load = load

    @property
    def tcp_push(self) -> Wrench:
        """The push at the TCP, along its axes."""
        return self._load.tcp_push

    @property
    def joint_push(self) -> tuple[float, ...]:
        """Torque (Nm) on each joint: applied, and of surfaces, parts and links on links."""
        load = self._load
        push, made = load._joint_push, None if load._links is None else load._links.yielding_to
        if load._folded is not None:
            push = tuple(map(add_numbers, push, load._folded))
        if load._handed_torques is not None:
            push = tuple(map(add_numbers, push, load._handed_torques))
        return push if made is None else tuple(map(add_numbers, push, made))


def _check(name: str, values: Sequence[float], count: int) -> None:
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"{name} is {values}, expected {count} finite numbers")


@cython.cfunc
def _sum_of(a: Wrench, b: Wrench) -> object:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


@cython.cfunc
@cython.exceptval(-1.0, check=True)
def _greatest(torques: Sequence[float]) -> cython.double:
    """No torque (Nm) is greater, in either direction."""
    greatest: cython.double = 0.0
    torque: cython.double
    for torque in torques:
        greatest = max(greatest, fabs(torque))
    return greatest
