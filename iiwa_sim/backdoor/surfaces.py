"""Adds, moves and removes surfaces while the simulator runs."""

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec

from iiwa_sim.cell.bodies import AnySurface, surface_of
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import IDENTITY, Frame, Vector, compose
from iiwa_sim.settings import Reader
from iiwa_sim.wording import harmless

MOST_SURFACES = 256
"""Most surfaces: all of them are evaluated in every tick."""


@contextmanager
def refusing(*faults: type[Exception]) -> Iterator[None]:
    """Raise these faults as `Refused`, with their message as the reason."""
    try:
        yield
    except faults as fault:
        raise Refused(EXECUTION, str(fault)) from None


def add(group: ControllerGroup, controller: Controller, settings: AnySurface) -> None:
    """Add a surface to the world of a group, at a pose in the base of a robot of it.

    Raises `Refused` for numbers out of range, for more than `MOST_SURFACES`, and where a TCP would be within
    it.
    """
    world, handling = controller.load.world, controller.handling
    taken = [*world.surfaces, *(part.name for part in (() if handling is None else handling.parts))]
    if len(world.surfaces) >= MOST_SURFACES:
        raise Refused(EXECUTION, f"{MOST_SURFACES} surfaces are there already: remove one first")
    reader = Reader("surface", CellFault)
    with refusing(CellFault):
        reader.converted(msgspec.to_builtins(settings), type(settings))
        reader.check("name", settings.name, settings.name not in taken, "a name no surface and no part has")
    _put(group, controller, surface_of(settings))


def move(group: ControllerGroup, controller: Controller, name: str, pose: Frame) -> None:
    """Move a surface. If it touches a TCP, it goes on pushing it, and takes it along by friction.

    Raises `Refused` if it does not, and a TCP would be within it. What lies on it rides up with it, and a
    held part is pushed.
    """
    _put(group, controller, _named(controller, name)._replace(pose=pose.to_transform()))


def remove(group: ControllerGroup, controller: Controller, name: str) -> None:
    """Remove a surface; raises `Refused` if there is none of the name."""
    _named(controller, name)
    for other in group.controllers:
        other.load.world.remove(name)


def check_outside(controller: Controller, tcp: Vector, *surfaces: Surface) -> None:
    """Raise `Refused` if the TCP (m, in the base) would be within a surface: one of those there by default.

    The contact sphere round the TCP may press against it, as in cell.toml; from within the force would be
    unbounded.
    """
    for surface in surfaces or controller.load.world.surfaces.values():
        depth_mm = -1e3 * surface.nearest(*tcp)[0]
        if depth_mm > 0.0:
            reason = f"the TCP would be {depth_mm:.3f} mm within surface {surface.name!r}"
            raise Refused(EXECUTION, harmless(reason))


def _named(controller: Controller, name: str) -> Surface:
    surfaces = controller.load.world.surfaces
    if name not in surfaces:
        there_are = f"there are {', '.join(map(repr, surfaces))}" if surfaces else "there is none"
        raise Refused(EXECUTION, f"no surface {name!r}: {harmless(there_are)}")
    return surfaces[name]


def _put(group: ControllerGroup, controller: Controller, surface: Surface) -> None:
    """Add or move a surface, given in the base of one robot, for all robots of a group."""
    seen = [
        (other, surface if base == IDENTITY else surface._replace(pose=compose(base, surface.pose)))
        for other, base in group.seen_from(controller)
    ]
    is_there = surface.name in controller.load.world.surfaces
    for other, each in seen:
        if not (is_there and other.load.world.touched(each.name)):
            check_outside(other, other.tcp().translation, each)
    for other, each in seen:
        if is_there:
            other.load.world.move(each.name, each.pose)
        else:
            other.load.world.put(each)
