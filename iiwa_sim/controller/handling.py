"""The gripper and the parts of a cell, wired to the controller's inputs and outputs."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.wires import InputWire, OutputWire
from iiwa_sim.frames import Frame, Transform, apply
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.wording import harmless
from iiwa_sim.world.gripper import CLOSES, OPENS, STAYS, Cup, Gripper, Jaws
from iiwa_sim.world.part import GONE, Part

if TYPE_CHECKING:
    from iiwa_sim.world.arm import Arm, Tell
    from iiwa_sim.world.scene import Scene, SceneBody
    from iiwa_sim.world.world import World

SENSORS = ("open", "closed", "holds")
MOST_CAPSULES = 8
"""Capsules of a jaw, side by side within it, as surfaces meet them."""
PLACED_M = 1e-3
"""Surfaces meet jaws that move where they were so much farther open or closed."""
NOTHING = 0
"""Stands for the number of an input or an output where there is none."""


class Wiring(NamedTuple):
    """Numbers of outputs and inputs, from 1; `NOTHING` for what is not wired."""

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


class PartState(msgspec.Struct, frozen=True):
    """A part in one tick."""

    name: str
    frame: Frame
    """Pose of the part in the base: mm, rad."""
    state: str
    """lies, falls, held, gone"""


class BodyState(msgspec.Struct, frozen=True):
    """A body of the scene in one tick."""

    name: str
    frame: Frame
    """Pose of the body in the base: mm, rad."""


class HandlingSetup(NamedTuple):
    """Gripper and parts at the start."""

    gripper: Jaws | Cup | None
    """The gripper; None in a cell with parts only."""
    wiring: Wiring
    parts: tuple[tuple[Part, Transform], ...] = ()
    """Parts with their poses in the base."""
    scene: Scene | None = None
    inputs: tuple[InputWire, ...] = ()
    outputs: tuple[OutputWire, ...] = ()
    """Wires between the scene and this robot's inputs and outputs."""


class HandlingState(NamedTuple):
    """Gripper and parts in a named state."""

    opening_m: float
    driven: int
    blocked: bool
    world: Any


class GripperState(msgspec.Struct, frozen=True):
    """A gripper in one tick."""

    opening_mm: float
    state: str
    """open, closed, holds, or between for neither of these"""


class Fingers:
    """The jaws of a gripper in the flange, at any opening."""

    def __init__(self, jaws: Jaws, tool_in_flange: Transform) -> None:
        wide, thick, long = jaws.jaw_m
        self._thick, self._radius = thick, 0.5 * min(wide, thick)
        count = min(MOST_CAPSULES, ceil(max(wide, thick) / (2.0 * self._radius)))
        spread = 0.5 * max(wide, thick) - self._radius
        self._share = 1.0 / count
        offs = [spread * (2.0 * number / (count - 1) - 1.0) if count > 1 else 0.0 for number in range(count)]
        places = [(off, 0.0) if wide >= thick else (0.0, off) for off in offs]
        top, tip = min(-self._radius, self._radius - long), -self._radius
        self._ends = [[apply(tool_in_flange, (x, y, z)) for z in (top, tip)] for x, y in places]
        self._across = tool_in_flange.rotation[1::3]

    def at(self, opening_m: float) -> tuple[Capsule, ...]:
        """Return the capsules with the jaws so far apart."""
        middle = 0.5 * (opening_m + self._thick)
        found = []
        for name, side in (("jaw 1", middle), ("jaw 2", -middle)):
            dx, dy, dz = (side * each for each in self._across)
            for (ax, ay, az), (bx, by, bz) in self._ends:
                ends = (ax + dx, ay + dy, az + dz), (bx + dx, by + dy, bz + dz)
                found.append(Capsule(name, 0, *ends, self._radius, self._share))
        return tuple(found)


class Handling:
    """The gripper of one robot and the parts in its cell, tick by tick."""

    def __init__(
        self,
        handled: HandlingSetup,
        io: Io,
        load: ExternalWrench,
        tick_s: float,
        arm: Arm | None,
    ) -> None:
        """The robot is at rest; forces on it go to `load`, and its `arm` is among the bodies of a world."""
        kind = handled.gripper
        self.gripper = arm.gripper if arm is not None else None if kind is None else Gripper(kind)
        self._wiring, self._io, self._load, self._tick_s = handled.wiring, io, load, tick_s
        self._driven_by: tuple[bool, ...] | None = None  # outputs, when it was asked how they drive the jaws
        self._drives = STAYS
        self._scene_driven_by: tuple[bool, ...] | None = None
        self._wrong: dict[str, bool] = {}
        self._told: tuple[bool, ...] = ()
        self._looked: tuple[float, bool, int] | None = None  # how the gripper was when its sensors were read
        self._jaws_at: tuple[float, Transform] | None = None  # how far apart, and where the TCP is
        self._changes = load.world.changes
        self._parts: tuple[PartState, ...] = ()
        self._parts_at = self._scene_at = -1
        self._scene, self._inputs, self._outputs = handled.scene, handled.inputs, handled.outputs
        self._scene_bodies: tuple[BodyState, ...] = ()
        self._sensed: list[bool] = []
        self.arm = load.bodies = arm
        """The robot among the bodies; None in a cell without parts, a scene or other robots."""
        self.world: World | None = None if arm is None else arm.world
        self._place_jaws()
        self._tell()
        self._drive_scene()
        self._read_scene()

    @property
    def settled(self) -> bool:
        """True if ticks change nothing, as long as the robot stays where it is and outputs as they are."""
        gripper, world, driven = self.gripper, self.world, self._driven()
        if (
            gripper is not None
            and not gripper.settled(driven)
            and (world is None or driven != gripper.driven)
        ):
            return False
        if self._outputs and self._scene_driven_by is not self._io.outputs:
            return False
        return world is None or (world.settled and self._changes == self._load.world.changes)

    @property
    def under_way(self) -> bool:
        """True if jaws or bodies move by themselves until they rest, or may after surfaces have."""
        arm, world = self.arm, self.world
        if self.settled or (arm is not None and arm.compliance) or (world is not None and world.conveys):
            return False
        return arm is None or world is None or len(world.arms) == 1 or not (arm.stands and world.is_calm)

    @property
    def holds(self) -> bool:
        """True if a part is held."""
        return self.arm is not None and self.arm.held >= 0

    def go(
        self,
        joints: Joints,
        coming: Joints | None,
        tcp: Transform,
        coming_tcp: Transform | None,
        compliance: int,
    ) -> None:
        """Tell the world where a tick brings the robot, as `Arm.go` takes it."""
        assert self.arm is not None
        if self._changes != self._load.world.changes:
            self._share_surfaces()
        if self._outputs:
            self._drive_scene()
        self.arm.go(joints, coming, tcp, coming_tcp, self._driven(), compliance)

    def feel(self) -> None:
        """End a tick: move jaws without parts, take what bodies do to the robot, switch inputs."""
        gripper, world, arm, load = self.gripper, self.world, self.arm, self._load
        if world is None or arm is None:
            driven = self._driven()
            if gripper is not None and not gripper.settled(driven):
                gripper.step(driven, self._tick_s)
                self._place_jaws()
                self._tell()
            return
        if self._inputs:
            self._read_scene()
        load.hand(arm.wrench, arm.push, arm.torques)
        if gripper is None:
            return
        if (gripper.opening_m, gripper.blocked, gripper.driven) != self._looked:
            self._looked = gripper.opening_m, gripper.blocked, gripper.driven
            self._tell()
        at = self._jaws_at
        if at is not None and abs(gripper.opening_m - at[0]) > (PLACED_M if arm.jaws_move else 0.0):
            self._place_jaws()

    def _share_surfaces(self) -> None:
        """Have the world's surfaces be where those of its first robot are; all robots have the same ones."""
        world, arm, surfaces = self.world, self.arm, self._load.world.surfaces.values()
        self._changes = self._load.world.changes
        if world is not None and arm is world.arms[0]:
            world.set_surfaces([each._replace(pose=arm.in_world(each.pose)) for each in surfaces])

    def tcp_is(self, joints: Joints, tcp: Transform) -> None:
        """The robot has been put somewhere, at rest."""
        self._place_jaws()
        if self.arm is not None:
            self.arm.place(joints, tcp, self._load.tool_in_flange)
            self._load.hand(self.arm.wrench, self.arm.push, self.arm.torques)

    def kept(self) -> HandlingState:
        """Return what a named state keeps; that of the first robot of several has the whole world."""
        gripper, world = self.gripper, self.world
        if world is not None and self._changes != self._load.world.changes:
            self._share_surfaces()
        jaws = (
            (0.0, STAYS, False) if gripper is None else (gripper.opening_m, gripper.driven, gripper.blocked)
        )
        is_first = world is not None and self.arm is world.arms[0]
        return HandlingState(*jaws, world.kept() if world is not None and is_first else None)

    def restore(self, kept: HandlingState) -> None:
        """Bring that back, with the TCP at rest where it was, the first robot of several first."""
        if self.gripper is not None:
            self.gripper.opening_m, self.gripper.driven, self.gripper.blocked = kept[:3]
        self._place_jaws()
        if self.world is not None and self.arm is not None:
            if kept.world is not None:
                self.world.restore(kept.world)
            self._changes = self._load.world.changes
            self._load.hand(self.arm.wrench, self.arm.push, self.arm.torques)
        # Inputs are as they were saved, when sensors may have told something else.
        self._told, self._looked = (), None
        self._tell()
        self._scene_driven_by, self._sensed = None, []
        self._read_scene()

    @property
    def parts(self) -> tuple[PartState, ...]:
        """Return the parts in the order of the cell."""
        world, arm = self.world, self.arm
        if world is not None and arm is not None and world.changes != self._parts_at:
            self._parts_at = world.changes
            self._parts = tuple(
                PartState(part.name, Frame.from_transform(arm.pose(number)), world.state(number))
                for number, part in enumerate(world.parts)
            )
        return self._parts

    @property
    def bodies(self) -> list[Part]:
        """The parts that are there, in the order in which the cell names them."""
        world = self.world
        return [] if world is None else [p for n, p in enumerate(world.parts) if world.state(n) != GONE]

    def tell_of_parts(self, tell: Tell) -> None:
        """Have `tell` take a line, and whether it warns, whenever a part is gripped, leaves the jaws, or is
        taken away."""
        if self.arm is not None:
            self.arm.tell = tell

    def lose(self) -> None:
        """Have the held part fall. Raises `Refused` where the gripper holds none."""
        if self.arm is None or self.arm.held < 0:
            raise Refused(EXECUTION, "the gripper holds no part")
        self.arm.let_go()

    def remove(self, name: str) -> None:
        """Take a part away. Raises `Refused` where there is none of this name."""
        there = {each.name for each in self.bodies}
        if self.world is None or name not in there:
            names = ", ".join(repr(each.name) for each in self.bodies)
            raise Refused(
                EXECUTION, harmless(f"no part {name!r}: there {f'are {names}' if names else 'is none'}")
            )
        self.world.remove([part.name for part in self.world.parts].index(name))

    @property
    def state(self) -> GripperState | None:
        """The gripper as it is, whatever its sensors tell; None without one."""
        gripper = self.gripper
        if gripper is None:
            return None
        state = "holds" if gripper.holds else "open" if gripper.is_open else "between"
        return GripperState(1e3 * gripper.opening_m, "closed" if gripper.is_closed else state)

    def stick(self, stuck: bool) -> None:
        """Have the jaws stay where they are, until they are told not to."""
        gripper = self._its_gripper
        gripper.stuck = stuck
        if not stuck:
            gripper.driven = STAYS  # it looks at its outputs anew

    def mistake(self, sensor: str, tells: bool) -> None:
        """Have a sensor tell this, whatever is true. Raises `Refused` where there is no such sensor."""
        wired = [each for each in SENSORS if self._input(each) != NOTHING]
        if sensor not in wired:
            there_are = f"there are {', '.join(wired)}" if wired else "none is wired"
            raise Refused(EXECUTION, f"no sensor {sensor!r}: {there_are}")
        self._wrong[sensor] = tells
        self._tell()

    def repair(self) -> None:
        """End all faults of the gripper."""
        self.stick(False)
        self._wrong.clear()
        self._told, self._looked = (), None
        self._tell()

    def _drive_scene(self) -> None:
        """Have outputs drive the actuators of the scene that are wired to them."""
        world, io = self.world, self._io
        if world is None or not self._outputs or self._scene_driven_by is io.outputs:
            return
        self._scene_driven_by = io.outputs
        news = [each.drive(world.model, world.data, io.output(each.number)) for each in self._outputs]
        if any(news):
            world.wake()

    def _read_scene(self) -> None:
        """Switch the inputs that sensors of the scene are wired to, where that is news."""
        if self.world is None or not self._inputs:
            return
        data = self.world.data
        sensed = [each.is_on(data) for each in self._inputs]
        if sensed != self._sensed:
            self._sensed = sensed
            for each, on in zip(self._inputs, sensed, strict=True):
                self._io.wire(each.number, on)

    @property
    def scene_bodies(self) -> tuple[BodyState, ...]:
        """Return the bodies of the scene that are shown."""
        world, arm = self.world, self.arm
        if (
            world is not None
            and arm is not None
            and self._scene is not None
            and world.changes != self._scene_at
        ):
            self._scene_at = world.changes
            self._scene_bodies = tuple(
                BodyState(each.name, Frame.from_transform(arm.in_base(each.pose_in(world.data))))
                for each in self._scene.bodies
            )
        return self._scene_bodies

    @property
    def cameras(self) -> tuple[str, ...]:
        """Return the names of the scene's cameras."""
        return () if self._scene is None else self._scene.cameras

    @property
    def scene_shapes(self) -> tuple[SceneBody, ...]:
        """Return what the bodies of the scene look like, in the same order."""
        return () if self._scene is None else self._scene.bodies

    @property
    def _its_gripper(self) -> Gripper:
        if self.gripper is None:
            raise Refused(EXECUTION, "the cell has no gripper")
        return self.gripper

    def _input(self, sensor: str) -> int:
        number: int = getattr(self._wiring, f"{sensor}_input")
        return number

    def _driven(self) -> int:
        """Return in which direction outputs drive the jaws."""
        if self.gripper is None:
            return STAYS
        if self._io.outputs is not self._driven_by:  # a change makes another tuple
            self._driven_by, wiring = self._io.outputs, self._wiring
            closes = self._io.output(wiring.close_output)
            opens = not closes if wiring.open_output == NOTHING else self._io.output(wiring.open_output)
            self._drives = STAYS if opens == closes else OPENS if opens else CLOSES
        return self._drives

    def _place_jaws(self) -> None:
        """Tell the arm where its jaws are."""
        if self.gripper is None or not isinstance(self.gripper.kind, Jaws):
            return
        now = self.gripper.opening_m, self._load.tool_in_flange
        if self._jaws_at is None or now[1] != self._jaws_at[1]:
            self._fingers = Fingers(self.gripper.kind, now[1])
        if now != self._jaws_at:
            self._jaws_at = now
            self._load.jaws_are(self._fingers.at(now[0]))

    def _tell(self) -> None:
        """Switch the inputs, where that is news: a test bench may have switched one otherwise."""
        gripper = self.gripper
        if gripper is None:
            return
        so = (gripper.is_open, gripper.is_closed, gripper.holds)
        told = tuple(map(self._wrong.get, SENSORS, so)) if self._wrong else so
        if told == self._told:
            return
        self._told = told
        for sensor, on in zip(SENSORS, told, strict=True):
            number = self._input(sensor)
            if number != NOTHING:
                self._io.wire(number, on)
