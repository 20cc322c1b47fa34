"""The external load on the arm: what pushes it and what it touches, and what its joints feel of it."""

from collections.abc import Sequence
from math import isfinite

from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.world_kernel import AT_REST, World, seen_from, velocity_between
from iiwa_sim.contact.wrench import NO_WRENCH, Wrench, add
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.robot.model import Model

Felt = tuple[Transform, tuple[Vector, Vector] | None]
"""Where a motion has brought the TCP to, in the base, and what surfaces do to it there, in base axes: force
(N) and torque (Nm); None where they have yet to be felt."""


class ExternalLoad:
    """What acts on the arm from outside, tick by tick; nothing, and exactly 0, in free space.

    A wrench at the TCP and a torque on each joint are pushed from outside, for as long as they are set. What
    the world does is felt once per tick. The readings are their sum, with noise if there is any.
    """

    def __init__(
        self,
        model: Model,
        tool_in_flange: Transform,
        joints: Sequence[float],
        world: World | None = None,
        noise: Noise | None = None,
    ) -> None:
        """With the robot at rest at `joints` (rad), and the TCP at `tool_in_flange`."""
        self._wrench: Wrench = NO_WRENCH
        self._joint_push: tuple[float, ...] = (0.0,) * model.joint_count
        self._touch: Wrench = NO_WRENCH
        self._model = model
        self._tcp = model.tcp(tool_in_flange)
        self.world = World((), 0.0) if world is None else world
        """What the TCP can touch; what changes there is felt from the next tick on."""
        self._noise = noise
        self._place: Vector | None = None  # of the TCP, when the world was felt last
        self._feel(self._tcp.pose(joints), 0.0)

    @property
    def wrench(self) -> Wrench:
        """Pushed: at the TCP, along its axes.

        Raises `ValueError` where it is set to anything but six finite numbers.
        """
        return self._wrench

    @wrench.setter
    def wrench(self, wrench: Wrench) -> None:
        _check("wrench", wrench, len(NO_WRENCH))
        self._wrench = wrench

    @property
    def joint_push(self) -> tuple[float, ...]:
        """Pushed: torque (Nm) on each joint.

        Raises `ValueError` where it is set to anything but a finite number for each of them.
        """
        return self._joint_push

    @joint_push.setter
    def joint_push(self, torques: tuple[float, ...]) -> None:
        _check("joint_push", torques, len(self._joint_push))
        self._joint_push = torques

    @property
    def changes(self) -> bool:
        """Whether a tick can change anything: without noise, and far from surfaces, it does not."""
        return self._noise is not None or self._place is not None or not self.world.empty

    @property
    def touching(self) -> bool:
        """Whether surfaces have done anything to the robot in the last tick."""
        return self._touch is not NO_WRENCH

    def step(self, joints: Sequence[float], tick_s: float, felt: Felt | None = None) -> None:
        """A tick has brought the robot to `joints` (rad): feel the world there, and draw new noise.

        What a motion has `felt` there is not felt again: one owner of the contact in every tick.
        """
        if self._noise is not None:
            self._noise.next()
        if self.world.empty:
            self._touch, self._place = NO_WRENCH, None
        else:
            tcp, touch = (self._tcp.pose(joints), None) if felt is None else felt
            if touch is None:
                self._feel(tcp, tick_s)
            else:
                self._place = tcp.translation
                self._touch = seen_from(tcp.rotation, touch)

    def place(self, joints: Sequence[float], tool_in_flange: Transform) -> None:
        """The robot is at rest at `joints` (rad) with this tool, and has not been anywhere before."""
        self._tcp = self._model.tcp(tool_in_flange)
        self.world.forget()
        self._place = None
        self._feel(self._tcp.pose(joints), 0.0)

    def seed(self, seed: int) -> None:
        """Begin the noise anew with this seed, if there is any."""
        if self._noise is not None:
            self._noise.seed(seed)

    def cartesian_force(self) -> Wrench:
        """The reading of the wrench at the TCP, along its axes."""
        wrench = self._acting()
        return wrench if self._noise is None else add(wrench, self._noise.wrench)

    def joint_torques(self, joints: Sequence[float]) -> tuple[float, ...]:
        """The reading of the external torque (Nm) on each joint, with the robot at `joints` (rad).

        Pushes, and the wrench at the TCP by its transposed Jacobian.
        """
        torques = self._joint_push
        wrench = self._acting()
        if any(wrench):
            made = self._tcp.torques(joints, wrench)
            torques = tuple(a + b for a, b in zip(torques, made, strict=True))
        if self._noise is not None:
            torques = tuple(a + b for a, b in zip(torques, self._noise.joint_torques, strict=True))
        return torques

    def _acting(self) -> Wrench:
        if self._touch is NO_WRENCH:
            return self._wrench
        return self._touch if self._wrench is NO_WRENCH else add(self._touch, self._wrench)

    def _feel(self, tcp: Transform, tick_s: float) -> None:
        rotation, place = tcp
        velocity = AT_REST if self._place is None else velocity_between(self._place, place, tick_s)
        self._place = place
        self._touch = seen_from(rotation, self.world.feel(place, velocity, tick_s))


def _check(name: str, values: Sequence[float], count: int) -> None:
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"{name} is {values}, expected {count} finite numbers")
