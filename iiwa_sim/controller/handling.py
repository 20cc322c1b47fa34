"""The gripper of a robot and the bodies of its cell, wired to the controller's inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import ceil, inf
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.wires import InputWire, OutputWire
from iiwa_sim.frames import Frame, Transform, apply
from iiwa_sim.motion.impedance import STIFF
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.motions import Motions
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.wording import harmless
from iiwa_sim.world.gripper import CLOSES, OPENS, STAYS, Cup, Jaws
from iiwa_sim.world.part import GONE, Part

if TYPE_CHECKING:
    from iiwa_sim.world.arm import Arm
    from iiwa_sim.world.scene import Scene

MOST_CAPSULES = 8
"""Capsules of a jaw, side by side within it, as surfaces meet them."""
PLACED_M = 1e-3
"""Surfaces meet jaws that move where they were so much farther open or closed."""
NOTHING = 0
"""Stands for the number of an input or an output where there is none."""


class Wiring(NamedTuple):
    """Numbers of outputs and inputs, from 1; `NOTHING` without a wire."""

    close_output: int
    """Output that closes when on, and opens when off where there is no other."""
    open_output: int = NOTHING
    """Output that opens when on; with both on, or both off, the jaws stay where they are."""
    open_input: int = NOTHING
    """Input that is on while the jaws are open to the stroke."""
    closed_input: int = NOTHING
    """Input that is on while jaw touches jaw."""
    holds_input: int = NOTHING
    """Input that is on while the jaws press on a part."""


class BodyState(msgspec.Struct, frozen=True):
    """A body of the scene in one tick."""

    name: str
    frame: Frame
    """Pose in the base: mm, rad."""


class PartState(BodyState, frozen=True):
    """A part in one tick."""

    state: str
    """lies, falls, held, gone"""


class GripperState(msgspec.Struct, frozen=True):
    """A gripper in one tick."""

    opening_mm: float
    state: str
    """open, closed, holds, or between for neither of these"""


class HandlingSetup(NamedTuple):
    """Gripper, bodies and wires at the start."""

    gripper: Jaws | Cup | None = None
    wiring: Wiring = Wiring(NOTHING)
    parts: tuple[tuple[Part, Transform], ...] = ()
    """Parts with their poses in the world."""
    scene: Scene | None = None
    inputs: tuple[InputWire, ...] = ()
    outputs: tuple[OutputWire, ...] = ()
    """Wires between the scene and this robot's inputs and outputs."""


NO_HANDLING = HandlingSetup()


def capsules_of(jaws: Jaws, opening_m: float, tool_in_flange: Transform) -> list[Capsule]:
    """Return jaws at a distance from each other, in the flange."""
    wide, thick, long = jaws.jaw_m
    radius = 0.5 * min(wide, thick)
    count = min(MOST_CAPSULES, ceil(max(wide, thick) / (2.0 * radius)))
    spread = 0.5 * max(wide, thick) - radius
    offs = [spread * (2 * k / max(count - 1, 1) - 1.0) for k in range(count)]
    top, tip, middle, found = min(-radius, radius - long), -radius, 0.5 * (opening_m + thick), []
    for name, side in (("jaw 1", middle), ("jaw 2", -middle)):
        for off in offs:
            x, y = (off, side) if wide >= thick else (0.0, side + off)
            start, end = (apply(tool_in_flange, (x, y, z)) for z in (top, tip))
            found.append(Capsule(name, 0, start, end, radius, 1.0 / count))
    return found


class Handling:
    """The gripper of one robot and the bodies of its cell, tick by tick."""

    def __init__(self, setup: HandlingSetup, io: Io, load: ExternalWrench, arm: Arm) -> None:
        """The robot is at rest; forces on its `arm`, which is among the bodies of a world, go to `load`."""
        self._setup, self._io, self._load = setup, io, load
        self.arm = load.bodies = arm
        self.world, self.gripper, self.scene = arm.world, arm.gripper, setup.scene
        wired = {name: getattr(setup.wiring, f"{name}_input") for name in ("open", "closed", "holds")}
        self._sensors = {sensor: number for sensor, number in wired.items() if number != NOTHING}
        self._wrong: dict[str, bool] = {}  # sensors with a fault, and their fixed state
        self._inputs: dict[int, bool] = {}  # last states set, by number
        self._rested = False
        self._driven_by: tuple[bool, ...] | None = None  # outputs that drive jaws and scene
        self._driven = STAYS  # direction of the jaws
        self._jaws_at: tuple[float, Transform] | None = None  # how far apart, and where the TCP is
        self._changes = load.contact.changes
        self._place_jaws()
        self._drive()
        self._set_inputs()

    @property
    def settled(self) -> bool:
        """True if ticks change nothing, as long as the robot stays where it is and outputs as they are."""
        gripper = self.gripper
        if self._driven_by is not self._io.outputs or self._changes != self._load.contact.changes:
            return False
        if gripper is not None and not gripper.stuck and self._driven != gripper.driven:
            return False
        return self.world.settled

    @property
    def under_way(self) -> bool:
        """True if jaws or bodies move by themselves until they rest, or may after surfaces have."""
        world = self.world
        return not (self.settled or world.conveyors.any() or any(arm.compliance for arm in world.arms))

    def go(self, motions: Motions) -> None:
        """Pass the pose of the robot after this tick, and after the next one, to the world."""
        load, coming = self._load, motions.coming
        coming_tcp = None if coming is None else load.coming_tcp(coming)
        if self._changes != load.contact.changes:
            self._share_surfaces()
        if self._driven_by is not self._io.outputs:
            self._drive()
        joints, compliance = motions.joints, motions.compliance if coming is None else STIFF
        self.arm.go(joints, load.tcp(joints), coming_tcp, self._driven, compliance)

    @property
    def skips(self) -> bool:
        """True if inputs, jaws and bodies stay as they are in coming ticks in which the arm meets nothing."""
        world, gripper = self.world, self.gripper
        if gripper is None or self._driven != gripper.driven or self._driven_by is not self._io.outputs:
            return False
        return self._rested and world.quiet and world.behind and self.arm.base is None

    def take_forces(self) -> None:
        """End a tick: take the forces of bodies on the robot, switch inputs."""
        gripper, arm = self.gripper, self.arm
        self._load.take_parts(arm.wrench, arm.push, arm.torques)
        # Only jaws that move, or a scene, make news.
        rested, self._rested = self._rested, arm.jaws_rest and not self._setup.inputs
        if not (rested and self._rested):
            self._set_inputs()
        at = self._jaws_at
        if at and gripper and abs(gripper.opening_m - at[0]) > (PLACED_M if arm.jaws_move else 0.0):
            self._place_jaws()

    def _share_surfaces(self) -> None:
        """Have the world's surfaces be where those of its first robot are; all robots have the same ones."""
        world, arm, surfaces = self.world, self.arm, self._load.contact.surfaces.values()
        self._changes = self._load.contact.changes
        if arm is world.arms[0]:
            world.set_surfaces([each._replace(pose=arm.in_world(each.pose)) for each in surfaces])

    def place_tcp(self, joints: Joints, tcp: Transform) -> None:
        """Notice that the robot has been placed, at rest."""
        self._place_jaws()
        self.arm.place(joints, tcp, self._load.tool_in_flange)
        self._load.take_parts(self.arm.wrench, self.arm.push, self.arm.torques)

    def kept(self) -> Callable[[], None]:
        """Return a function that restores the present state; call that of the first robot first."""
        self._share_surfaces()
        gripper, world, arm = self.gripper, self.world, self.arm
        jaws = gripper and (gripper.opening_m, gripper.driven, gripper.blocked)
        state = world.kept() if arm is world.arms[0] else None

        def restore() -> None:
            if gripper and jaws:
                gripper.opening_m, gripper.driven, gripper.blocked = jaws
            self._place_jaws()
            if state is not None:
                world.restore(state)
            self._changes = self._load.contact.changes
            self._load.take_parts(arm.wrench, arm.push, arm.torques)
            self._driven_by, self._inputs = None, {}
            self._set_inputs()

        return restore

    @property
    def parts(self) -> tuple[PartState, ...]:
        """The parts in the order of the cell."""
        world, arm = self.world, self.arm
        return tuple(
            PartState(part.name, Frame.from_transform(arm.in_base(world.pose(number))), world.state(number))
            for number, part in enumerate(world.parts)
        )

    @property
    def scene_bodies(self) -> tuple[BodyState, ...]:
        """The bodies of the scene that are shown."""
        arm, data = self.arm, self.world.data
        return tuple(
            BodyState(each.name, Frame.from_transform(arm.in_base(each.pose_in(data))))
            for each in (() if self.scene is None else self.scene.bodies)
        )

    @property
    def bodies(self) -> list[Part]:
        """The parts that are there, in the order in which the cell names them."""
        return [part for number, part in enumerate(self.world.parts) if self.world.state(number) != GONE]

    def lose(self) -> None:
        """Drop the held part. Raises `Refused` if the gripper holds none."""
        if self.arm.held < 0:
            raise Refused(EXECUTION, "the gripper holds no part")
        self.arm.let_go()

    def remove(self, name: str) -> None:
        """Take a part away. Raises `Refused` for an unknown name."""
        there = [each.name for each in self.bodies]
        if name not in there:
            names = ", ".join(map(repr, there)) or "none"
            raise Refused(EXECUTION, harmless(f"no part {name!r}: there are {names}"))
        self.world.remove([part.name for part in self.world.parts].index(name))

    @property
    def state(self) -> GripperState | None:
        """The true state of the gripper; None without one."""
        gripper = self.gripper
        return None if gripper is None else GripperState(1e3 * gripper.opening_m, gripper.state)

    def stick(self, stuck: bool) -> None:
        """Stick the jaws where they are, or end that."""
        if self.gripper is None:
            raise Refused(EXECUTION, "the cell has no gripper")
        self.gripper.stuck = stuck
        if not stuck:
            self.gripper.driven = STAYS  # outputs are read again

    def mistake(self, sensor: str, on: bool) -> None:
        """Fix the input of a sensor to this state. Raises `Refused` for an unknown sensor."""
        if sensor not in self._sensors:
            raise Refused(EXECUTION, f"no sensor {sensor!r}: there are {', '.join(self._sensors) or 'none'}")
        self._wrong[sensor] = on
        self._set_inputs()

    def repair(self) -> None:
        """End all faults of the gripper."""
        self.stick(False)
        self._wrong, self._inputs = {}, {}
        self._set_inputs()

    def _drive(self) -> None:
        """Drive the jaws, and the wired actuators of the scene, by the outputs."""
        world, io, wiring = self.world, self._io, self._setup.wiring
        self._driven_by = io.outputs  # a change makes another tuple
        if self.gripper is not None:
            closes = io.output(wiring.close_output)
            opens = not closes if wiring.open_output == NOTHING else io.output(wiring.open_output)
            self._driven = STAYS if opens == closes else OPENS if opens else CLOSES
        news = [each.drive(world.model, world.data, io.output(each.number)) for each in self._setup.outputs]
        if any(news):
            world.wake()

    def _place_jaws(self) -> None:
        """Pass the place of the jaws to the contact of the links."""
        if self.gripper is None or not isinstance(self.gripper.kind, Jaws):
            return
        now = self.gripper.opening_m, self._load.tool_in_flange
        if now != (was := self._jaws_at):
            moved_m = 0.5 * (now[0] - was[0]) if was and was[1] == now[1] else inf
            self._jaws_at = now
            self._load.set_jaws(partial(capsules_of, self.gripper.kind, *now), moved_m)

    def _set_inputs(self) -> None:
        """Switch the inputs whose sensors have changed: others keep the state that a test gave them."""
        gripper, data = self.gripper, self.world.data
        now = {each.number: each.is_on(data) for each in self._setup.inputs}
        if gripper is not None:
            state = {sensor: gripper.state == sensor for sensor in self._sensors} | self._wrong
            now |= {number: state[sensor] for sensor, number in self._sensors.items()}
        for number, on in now.items():
            if self._inputs.get(number) is not on:
                self._io.wire(number, on)
        self._inputs = now
