"""What the robot works with, wired to the controller's inputs and outputs."""

from typing import NamedTuple

import msgspec

from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.handling_kernel import HandlingTicks
from iiwa_sim.controller.io import Io
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.handling.aside_kernel import Aside
from iiwa_sim.handling.falling import GONE, Body
from iiwa_sim.handling.fingers_kernel import Fingers
from iiwa_sim.handling.gripper import CLOSES, OPENS, STAYS, Gripper, Jaws
from iiwa_sim.handling.lying import start
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.told import Tell, ToldWorkpieces
from iiwa_sim.handling.workpieces import Parts
from iiwa_sim.wording import harmless

SENSORS = ("open", "closed", "holds")
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
    """Input that is on while jaw lies on jaw."""
    holds_input: int = NOTHING
    """Input that is on while the jaws press on a part."""


class PartState(msgspec.Struct, frozen=True):
    """A part in one tick."""

    name: str
    frame: Frame
    """Pose of the middle of the part, in the base: mm, rad."""
    state: str
    """lies, falls, held, gone"""


class HandlingSetup(NamedTuple):
    """What a robot works with, at the beginning."""

    jaws: Jaws
    wiring: Wiring
    parts: tuple[tuple[Part, Transform], ...] = ()
    """Parts with the poses of their middles in the base."""


class HandlingState(NamedTuple):
    """What a named state keeps of it."""

    opening_m: float
    parts: Parts


class GripperState(msgspec.Struct, frozen=True):
    """A gripper in one tick."""

    opening_mm: float
    state: str
    """open, closed, holds, or between for neither of these"""


class Handling(HandlingTicks):
    """The gripper of one robot and the parts in its cell, in their ticks."""

    def __init__(self, handled: HandlingSetup, io: Io, load: ExternalLoad, tick_s: float) -> None:
        """What a part does to the robot is told to `load`, whose surfaces parts lie on."""
        super().__init__(Gripper(handled.jaws), io, load)
        self._wiring = handled.wiring
        self._tick_s = tick_s
        self._driven_by: tuple[bool, ...] | None = None  # outputs, when it was asked how they drive the jaws
        self._drives = STAYS
        self._wrong: dict[str, bool] = {}
        self._told: tuple[bool, ...] = ()
        self._radius_m = load.world.radius_m
        self._jaws_at: tuple[float, Transform] | None = None  # how far apart, and where the TCP is
        self._parts_told: ToldWorkpieces | None = None
        if handled.parts:
            surfaces = list(load.world.surfaces.values())
            bodies = start(handled.parts, surfaces)
            self.workpieces = self._parts_told = ToldWorkpieces(bodies, surfaces, self.gripper, tick_s)
            self._aside = Aside(self.workpieces, load, tick_s, handled.jaws.stroke_m)
        self._names = [part.name for part, _ in handled.parts]
        self._parts_at = -1
        self._parts: tuple[PartState, ...] = ()
        self._place_jaws()
        self._tell()

    @property
    def settled(self) -> bool:
        """Whether ticks change nothing, as long as the robot stays where it is and outputs as they are."""
        return not self.under_way and (self._aside is None or self._aside.settled)

    @property
    def under_way(self) -> bool:
        """Whether jaws or parts move by themselves, or may after surfaces have; what the arm pushes may stand
        still for a tick, and go on then."""
        pieces = self.workpieces
        if pieces is None:
            return not self._jaws_rest()
        rest = self._jaws_rest() or (pieces.squeezes and self.gripper.settled(self._driven()))
        return not (rest and pieces.settled) or self._changes != self._load.world.changes

    def _jaws_rest(self) -> bool:
        pieces, gripper = self.workpieces, self.gripper
        lets_go = pieces is not None and gripper.blocked and not pieces.held
        return gripper.settled(self._driven()) and not lets_go

    def _move_jaws(self, tcp: Transform | None) -> None:
        pieces, gripper, was_m = self.workpieces, self.gripper, self.gripper.opening_m
        driven = self._driven()
        gripper.step(driven, 0.0 if pieces is None else pieces.width_m, self._tick_s)
        if pieces is not None and tcp is not None and not pieces.held:
            closes = driven == CLOSES and gripper.opening_m < was_m
            if gripper.driven == OPENS:
                pieces.squeezed = ()
            if closes or pieces.squeezed:
                width_m = pieces.grip(tcp, was_m)
                if width_m > 0.0:
                    gripper.block(width_m)
        self._place_jaws()

    def _place_jaws(self) -> None:
        """Tell the arm where its jaws are."""
        now = self.gripper.opening_m, self._load.tool_in_flange
        if self._jaws_at is None or now[1] != self._jaws_at[1]:
            self._fingers = Fingers(self.gripper.jaws, now[1], self._radius_m)
        if now != self._jaws_at:
            self._jaws_at = now
            self._load.jaws_are(self._fingers.at(now[0]))

    def tcp_is(self, tcp: Transform) -> None:
        """The robot has been put somewhere, at rest."""
        self._place_jaws()
        if self._aside is not None:
            self._aside.forget()
        if self.workpieces is not None:
            self.workpieces.tcp_is(tcp)
            self._load.hand(self.workpieces.wrench, self.workpieces.weight)

    def kept(self) -> HandlingState:
        """What a named state keeps: parts know of surfaces that have moved since the last tick."""
        self.look_at_surfaces()
        return HandlingState(
            self.gripper.opening_m, Parts() if self.workpieces is None else self.workpieces.kept()
        )

    def restore(self, kept: HandlingState, tcp: Transform) -> None:
        """Bring that back, with the TCP at rest at a pose."""
        self.gripper.opening_m = kept.opening_m
        self.gripper.driven = self._driven()
        self.gripper.blocked = kept.parts.held is not None or bool(kept.parts.squeezed)
        self._rest = None
        self._place_jaws()
        if self._aside is not None:
            self._aside.forget()
        if self.workpieces is not None:
            self._changes = self._load.world.changes
            self.workpieces.restore(kept.parts, tcp, list(self._load.world.surfaces.values()))
            self._load.hand(self.workpieces.wrench, self.workpieces.weight)
        self._told = ()  # inputs are as they were saved, when sensors may have told something else
        self._tell()

    @property
    def parts(self) -> tuple[PartState, ...]:
        """All parts, in the order in which the cell names them."""
        pieces = self.workpieces
        if pieces is not None and pieces.changes != self._parts_at:
            self._parts_at = pieces.changes
            self._parts = tuple(
                PartState(each.part.name, Frame.from_transform(each.pose), each.state) for each in self.bodies
            )
        return self._parts

    @property
    def bodies(self) -> list[Body]:
        """All parts, in the order in which the cell names them; `workpieces` has them by height."""
        if self.workpieces is None:
            return []
        there = self.workpieces.bodies
        return [there[name] for name in self._names]

    def tell_of_parts(self, tell: Tell) -> None:
        """Have `tell` take a line, and whether it warns, whenever a part is gripped, leaves the jaws, or is
        taken away."""
        if self._parts_told is not None:
            self._parts_told.tell = tell

    def lose(self) -> None:
        """A fault: what the jaws hold falls. Raises `Refused` where they hold nothing."""
        if self._parts_told is None or not self._parts_told.held:
            raise Refused(EXECUTION, "the gripper holds no part")
        self._parts_told.drop()

    def remove(self, name: str) -> None:
        """A fault: a part is missing. Raises `Refused` where there is none of this name."""
        there = [] if self.workpieces is None else [each.name for each in self.parts if each.state != GONE]
        if self.workpieces is None or name not in there:
            there_are = f"there are {', '.join(map(repr, there))}" if there else "there is none"
            raise Refused(EXECUTION, harmless(f"no part {name!r}: {there_are}"))
        self.workpieces.remove(name)

    @property
    def state(self) -> GripperState:
        """The gripper as it is, whatever its sensors tell."""
        gripper = self.gripper
        state = "holds" if gripper.holds else "open" if gripper.is_open else "between"
        return GripperState(1e3 * gripper.opening_m, "closed" if gripper.is_closed else state)

    def stick(self, stuck: bool) -> None:
        """A fault: the jaws stay where they are, until they are told not to."""
        self.gripper.stuck = stuck
        self._rest = None

    def mistake(self, sensor: str, tells: bool) -> None:
        """A fault: a sensor tells this, whatever is so. Raises `Refused` where there is no such sensor."""
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
        self._told = ()
        self._tell()

    def _input(self, sensor: str) -> int:
        number: int = getattr(self._wiring, f"{sensor}_input")
        return number

    def _driven(self) -> int:
        """Which way outputs drive the jaws."""
        if self._io.outputs is not self._driven_by:  # a change makes another tuple
            self._driven_by, wiring = self._io.outputs, self._wiring
            closes = self._io.output(wiring.close_output)
            opens = not closes if wiring.open_output == NOTHING else self._io.output(wiring.open_output)
            self._drives = STAYS if opens == closes else OPENS if opens else CLOSES
        return self._drives

    def _tell(self) -> None:
        """Switch the inputs, where that is news: a bench may have switched one otherwise."""
        gripper = self.gripper
        so = (gripper.is_open, gripper.is_closed, gripper.holds)
        told = tuple(map(self._wrong.get, SENSORS, so)) if self._wrong else so
        if told == self._told:
            return
        self._told = told
        for sensor, on in zip(SENSORS, told, strict=True):
            number = self._input(sensor)
            if number != NOTHING:
                self._io.wire(number, on)
