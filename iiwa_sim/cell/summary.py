"""A summary of a cell in a few lines, for its author."""

from collections.abc import Iterator, Sequence
from math import degrees
from typing import TYPE_CHECKING

from iiwa_sim.cell.cell import CLOSE_M, Cell, shared_world
from iiwa_sim.controller.carrying import NO_TOOL
from iiwa_sim.frames import Frame, compose
from iiwa_sim.robot.model import arm_model
from iiwa_sim.wording import harmless
from iiwa_sim.world.gripper import Jaws

if TYPE_CHECKING:
    from iiwa_sim.world.world import World


def summary(cells: Sequence[Cell]) -> str:
    """The lines of all robots; raises `CellFault` for bodies that are in each other."""
    world = shared_world(cells, 0.002)
    return "\n".join("".join(f"{line}\n" for line in _lines(cell, world)) for cell in cells)


def _lines(cell: Cell, world: "World | None") -> Iterator[str]:
    tcp = compose(arm_model(cell.description).flange(cell.start), cell.tool_in_flange)
    radius_mm, name = 1e3 * cell.contact_radius_m, harmless(cell.description.name)
    yield f"robot {cell.name}: {name}" if cell.name else f"robot: {name}"
    if cell.name:
        yield f"base: {_frame(Frame.from_transform(cell.base))}"
    yield f"start: {_numbers(*map(degrees, cell.start))} deg"
    yield f"TCP in the flange: {_frame(Frame.from_transform(cell.tool_in_flange))}"
    yield f"TCP at the start: {_frame(Frame.from_transform(tcp))}"
    yield f"contact radius: {_numbers(radius_mm)} mm"
    if cell.tool != NO_TOOL:
        place = _numbers(*(1e3 * each for each in cell.tool.load.centre))
        yield f"tool: {_numbers(cell.tool.load.mass_kg)} kg, its centre at {place} mm in the flange"
    kind, wiring, parts, scene, inputs, outputs = cell.handled
    if kind is not None:
        way = f"{_numbers(1e3 * kind.stroke_m)} mm" if isinstance(kind, Jaws) else "suction"
        yield f"gripper: {way}, {_numbers(kind.force_n)} N, closed by output {wiring.close_output}"
    if scene is not None:
        bodies = ", ".join(repr(each.name) for each in scene.bodies)
        wires = [f"input {each.number}" for each in inputs]
        wires += [f"output {each.number}" for each in outputs]
        yield f"scene: {harmless(bodies)}; wired: {', '.join(wires) or 'nothing'}"
    for number, (part, _) in enumerate(parts):
        touched = [] if world is None else world.near(number, CLOSE_M)
        shape, kg = type(part.shape).__name__.lower(), _numbers(part.mass_kg)
        yield f"part {part.name!r}: {shape}, {kg} kg, {f'lies on {touched[0]!r}' if touched else 'falls'}"
    for surface in cell.seen():
        away_mm = 1e3 * surface.nearest(*tcp.translation)[0] - radius_mm
        there = f"{_numbers(away_mm)} mm away" if away_mm >= 0.0 else f"pressed in by {_numbers(-away_mm)} mm"
        kind_of = type(surface.shape).__name__.lower()
        yield f"{kind_of} {surface.name!r}: {_numbers(surface.stiffness)} N/m, {there}"
    yield f"{len(cell.input_names)} inputs, {len(cell.output_names)} outputs"


def _frame(frame: Frame) -> str:
    return f"{_numbers(*frame[:3])} mm, {_numbers(*frame[3:])} rad"


def _numbers(*values: float) -> str:
    return " ".join(f"{round(value, 3) + 0.0:.7g}" for value in values)
