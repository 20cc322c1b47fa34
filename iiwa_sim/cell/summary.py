"""A summary of a cell in a few lines, for its author."""

from collections.abc import Iterator
from math import degrees

from iiwa_sim.cell.bodies import CLOSE_M
from iiwa_sim.cell.cell import Cell, shared_world
from iiwa_sim.controller.limits_watch import Safety
from iiwa_sim.frames import Frame, compose
from iiwa_sim.robot.model import Model
from iiwa_sim.wording import harmless
from iiwa_sim.world.gripper import Jaws


def summary(cell: Cell) -> str:
    """The lines, each with its end."""
    tcp = compose(Model(cell.description).flange(cell.start), cell.tool_in_flange)
    radius_mm = 1e3 * cell.contact_radius_m
    name = harmless(cell.description.name)
    lines = [f"robot {cell.name}: {name}", f"base: {_frame(Frame.from_transform(cell.base))}"]
    lines = [
        *(lines if cell.name else [f"robot: {name}"]),
        f"start: {_numbers(*map(degrees, cell.start))} deg",
        f"TCP in the flange: {_frame(Frame.from_transform(cell.tool_in_flange))}",
        f"TCP at the start: {_frame(Frame.from_transform(tcp))}",
        f"contact radius: {_numbers(radius_mm)} mm",
    ]
    if cell.tool is not None:
        mass_kg, centre = cell.tool.load
        place = _numbers(*(1e3 * each for each in centre))
        lines.append(f"tool: {_numbers(mass_kg)} kg, its centre at {place} mm in the flange")
    if cell.handled is not None:
        lines += _handled(cell)
    for surface in cell.seen():
        away_mm = 1e3 * surface.nearest(*tcp.translation)[0] - radius_mm
        there = f"{_numbers(away_mm)} mm away" if away_mm >= 0.0 else f"pressed in by {_numbers(-away_mm)} mm"
        kind = type(surface.shape).__name__.lower()
        lines.append(f"{kind} {surface.name!r}: {_numbers(surface.stiffness)} N/m, {there}")
    if not cell.surfaces:
        lines.append("no surfaces")
    lines.append("no noise" if cell.noise_levels is None else f"noise with seed {cell.noise_levels.seed}")
    lines.append(_watched(cell.safety))
    lines.append(f"{len(cell.input_names)} inputs, {len(cell.output_names)} outputs")
    return "".join(f"{line}\n" for line in lines)


def _handled(cell: Cell) -> Iterator[str]:
    """Yield a line on the gripper, on the scene, and on each part."""
    assert cell.handled is not None
    kind, wiring, parts, scene, inputs, outputs = cell.handled
    if isinstance(kind, Jaws):
        stroke, speed = _numbers(1e3 * kind.stroke_m), _numbers(1e3 * kind.speed_m_per_s)
        on = f"output {wiring.close_output}"
        yield f"gripper: {stroke} mm at {speed} mm/s, {_numbers(kind.force_n)} N, closed by {on}"
    elif kind is not None:
        yield f"gripper: suction, {_numbers(kind.force_n)} N, on by output {wiring.close_output}"
    if scene is not None:
        bodies = ", ".join(repr(each.name) for each in scene.bodies)
        wires = [f"input {each.number}" for each in inputs] + [f"output {each.number}" for each in outputs]
        yield f"scene: {harmless(bodies)}; wired: {', '.join(wires) or 'nothing'}"
    shared = shared_world([cell], 0.002)
    handling = cell.controller(0.002, arm=None if shared is None else shared.arms[0]).handling
    world = None if handling is None else handling.world
    for number, (part, _) in enumerate(parts):
        touched = [] if world is None else world.near(number, CLOSE_M)
        shape, kg = type(part.shape).__name__.lower(), _numbers(part.mass_kg)
        yield f"part {part.name!r}: {shape}, {kg} kg, {f'lies on {touched[0]!r}' if touched else 'falls'}"


def _watched(safety: Safety) -> str:
    """A line on what makes the robot stop by itself: torques, forces, a speed, a box."""
    parts = ["torques of the joints"]
    if safety.force_n is not None:
        parts.append(f"{_numbers(safety.force_n)} N")
    if safety.torque_nm is not None:
        parts.append(f"{_numbers(safety.torque_nm)} Nm at the TCP")
    if safety.tcp_speed_m_per_s is not None:
        parts.append(f"{_numbers(1e3 * safety.tcp_speed_m_per_s)} mm/s")
    if safety.box is not None:
        low, high = (_numbers(*(1e3 * at for at in corner)) for corner in safety.box)
        parts.append(f"a box from {low} to {high} mm")
    return f"protective stop: {', '.join(parts)}"


def _frame(frame: Frame) -> str:
    return f"{_numbers(*frame[:3])} mm, {_numbers(*frame[3:])} rad"


def _numbers(*values: float) -> str:
    return " ".join(f"{round(value, 3) + 0.0:.7g}" for value in values)
