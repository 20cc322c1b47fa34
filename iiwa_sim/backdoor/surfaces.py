"""Adds, moves and removes surfaces while the simulator runs."""

from iiwa_sim.cell.cell import surface_of
from iiwa_sim.cell.placed import check_ranges
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.cell.surfaces import SURFACE_RANGES, AnySurface
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import IDENTITY, Frame, Transform, Vector, compose
from iiwa_sim.settings import Reader
from iiwa_sim.wording import harmless
from iiwa_sim.world.part import LIES

MOST_SURFACES = 256
"""Most surfaces: all of them are evaluated in every tick."""
SOURCE = "surface"
"""Stands for the name of a file in messages."""


def add(group: ControllerGroup, controller: Controller, settings: AnySurface) -> None:
    """Add a surface to the world of a group, at a pose in the base of a robot of it.

    Raises `Refused` for numbers out of range, for more than `MOST_SURFACES`, and where a TCP, or the middle
    of a part that lies, would be within it. A held part is pushed out the nearest way.
    """
    world = controller.load.world
    if len(world.surfaces) >= MOST_SURFACES:
        raise Refused(EXECUTION, f"{MOST_SURFACES} surfaces are there already: remove one first")
    reader = Reader(SOURCE, CellFault)
    try:
        reader.check_name_in_lines("name", settings.name)
        reader.check("name", settings.name, settings.name not in world.surfaces, "a name no surface has")
        parts = () if controller.handling is None else controller.handling.parts
        reader.check(
            "name", settings.name, settings.name not in [part.name for part in parts], "a name no part has"
        )
        check_ranges(reader, "", settings, SURFACE_RANGES)
    except CellFault as fault:
        raise Refused(EXECUTION, str(fault)) from None
    surface = surface_of(settings)
    seen = [(other, _seen(surface, base)) for other, base in group.seen_from(controller)]
    for other, there in seen:
        check_outside([there], other.tcp().translation)
        _check_parts(other, there, None)
    for other, there in seen:
        other.load.world.put(there)


def move(group: ControllerGroup, controller: Controller, name: str, pose: Frame) -> None:
    """Move a surface. If it touches a TCP, it goes on pushing it, and takes it along by friction.

    Raises `Refused` if it does not, and a TCP would be within it; and if the middle of a part that lies on
    something else would be. What lies on it rides up with it, and a held part is pushed.
    """
    surface = named(controller.load.world, name)._replace(pose=pose.to_transform())
    seen = [(other, _seen(surface, base)) for other, base in group.seen_from(controller)]
    for other, there in seen:
        world = other.load.world
        _check_parts(other, there, world.surfaces[name])
        if not world.touched(name):
            check_outside([there], other.tcp().translation)
    for other, there in seen:
        other.load.world.move(name, there.pose)


def remove(group: ControllerGroup, controller: Controller, name: str) -> None:
    """Remove a surface; raises `Refused` if there is none of the name."""
    named(controller.load.world, name)
    for other in group.controllers:
        other.load.world.remove(name)


def _seen(surface: Surface, base: Transform) -> Surface:
    """Return a surface whose pose is in a base, in the frame in which that base is."""
    return surface if base == IDENTITY else surface._replace(pose=compose(base, surface.pose))


def _check_parts(controller: Controller, surface: Surface, before: Surface | None) -> None:
    """Raises `Refused` where the middle of a part that lies would come to be within a surface that is put, or
    was moved from where it was before."""
    handling = controller.handling
    arm = None if handling is None else handling.arm
    for number, part in enumerate(() if arm is None else arm.world.parts):
        assert arm is not None
        world, middle = arm.world, arm.pose(number).translation
        rides = before is not None and surface.name in world.near(number, 1e-4)
        if world.state(number) != LIES or rides or surface.nearest(*middle)[0] >= 0.0:
            continue
        if before is None or before.nearest(*middle)[0] >= 0.0:
            raise Refused(EXECUTION, harmless(f"part {part.name!r} would be within surface {surface.name!r}"))


def named(world: TcpContact, name: str) -> Surface:
    """The surface of this name; raises `Refused` if there is none."""
    surfaces = world.surfaces
    if name not in surfaces:
        there_are = f"there are {', '.join(map(repr, surfaces))}" if surfaces else "there is none"
        raise Refused(EXECUTION, f"no surface {name!r}: {harmless(there_are)}")
    return surfaces[name]


def check_outside(surfaces: list[Surface], tcp: Vector) -> None:
    """Raises `Refused` if the TCP (m, in the base) would be within one of the surfaces.

    The contact sphere round the TCP may press against it, as in cell.toml; from within the force would be
    unbounded.
    """
    for surface in surfaces:
        depth_mm = -1e3 * surface.nearest(*tcp)[0]
        if depth_mm > 0.0:
            reason = f"the TCP would be {depth_mm:.3f} mm within surface {surface.name!r}"
            raise Refused(EXECUTION, harmless(reason))
