"""Adds, moves and removes surfaces while the simulator runs."""

from iiwa_sim.cell.cell import surface_of
from iiwa_sim.cell.placed import check_ranges
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.cell.surfaces import SURFACE_RANGES, AnySurface
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import Frame, Vector
from iiwa_sim.settings import Reader
from iiwa_sim.wording import harmless
from iiwa_sim.world.part import LIES

MOST_SURFACES = 256
"""Most surfaces: all of them are evaluated in every tick."""
SOURCE = "surface"
"""Stands for the name of a file in messages."""


def add(controller: Controller, settings: AnySurface) -> None:
    """Add a surface to the world.

    Raises `Refused` for numbers out of range, for more than `MOST_SURFACES`, and where the TCP, or the middle
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
    check_outside([surface], controller.tcp().translation)
    _check_parts(controller, surface, None)
    world.put(surface)


def move(controller: Controller, name: str, pose: Frame) -> None:
    """Move a surface. If it touches the TCP, it goes on pushing it, and takes it along by friction.

    Raises `Refused` if it does not, and the TCP would be within it; and if the middle of a part that lies on
    something else would be. What lies on it rides up with it, and a held part is pushed.
    """
    world = controller.load.world
    surface, transform = named(world, name), pose.to_transform()
    _check_parts(controller, surface._replace(pose=transform), surface)
    if not world.touched(name):
        check_outside([surface._replace(pose=transform)], controller.tcp().translation)
    world.move(name, transform)


def remove(controller: Controller, name: str) -> None:
    """Remove a surface; raises `Refused` if there is none of the name."""
    world = controller.load.world
    world.remove(named(world, name).name)


def _check_parts(controller: Controller, surface: Surface, before: Surface | None) -> None:
    """Raises `Refused` where the middle of a part that lies would come to be within a surface that is put, or
    was moved from where it was before."""
    handling = controller.handling
    world = None if handling is None else handling.world
    for number, part in enumerate(() if world is None else world.parts):
        assert world is not None
        middle = world.pose(number).translation
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
