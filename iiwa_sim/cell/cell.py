"""A cell: reads and checks a cell.toml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from math import degrees, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from iiwa_sim.cell.bodies import part_of, pose_of, surface_of
from iiwa_sim.cell.settings import CellFault, CellSettings, NoiseSettings, OneRobotSettings, RobotSettings
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.carrying import NO_TOOL, Tool
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.handling import NO_HANDLING, HandlingSetup
from iiwa_sim.controller.io import DEFAULT_INPUTS, DEFAULT_OUTPUTS, Io
from iiwa_sim.controller.limits_watch import NOTHING_MORE, Safety
from iiwa_sim.controller.wires import InputWire, OutputWire
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose, inverse
from iiwa_sim.robot.description import DEFAULT_ROBOT, RobotDescription, built_in_robots, load_robot
from iiwa_sim.robot.model import arm_model
from iiwa_sim.settings import Reader
from iiwa_sim.wording import harmless
from iiwa_sim.world.gripper import Gripper
from iiwa_sim.world.part import Part

if TYPE_CHECKING:
    from iiwa_sim.world.arm import Arm
    from iiwa_sim.world.scene import Scene
    from iiwa_sim.world.world import World

CLOSE_M = 1e-3
"""Parts and robots may be so deep in each other at the start, and parts in surfaces."""


@dataclass(frozen=True)
class Cell:
    """A robot and its surroundings, which it may share with others."""

    description: RobotDescription
    start: tuple[float, ...]
    """Joint positions (rad) in which the robot starts."""
    tool_in_flange: Transform
    """Pose of the TCP in the flange."""
    contact_radius_m: float = 0.0
    """Radius (m) of the sphere round the TCP that touches surfaces."""
    surfaces: tuple[Surface, ...] = ()
    """In the world, the base of a robot that stands alone."""
    noise: NoiseSettings | None = None
    input_names: tuple[str, ...] = DEFAULT_INPUTS
    output_names: tuple[str, ...] = DEFAULT_OUTPUTS
    safety: Safety = NOTHING_MORE
    """Limits that the robot watches besides the torques on its joints."""
    tool: Tool = NO_TOOL
    """The tool at the flange, with its mass."""
    handled: HandlingSetup = NO_HANDLING
    """The gripper with its wiring, and the parts, which are in the world."""
    name: str = ""
    """The name of one of several robots."""
    base: Transform = IDENTITY
    """The pose of the robot's base in the world."""
    ports: dict[str, int] = field(default_factory=dict)
    """The port of each protocol of a robot with a name; 0 for a free one."""
    path: Path | None = field(default=None, compare=False)
    """The file it was read from, if it was."""

    def seen(self) -> tuple[Surface, ...]:
        """Return the surfaces in the robot's base."""
        to_base = inverse(self.base)
        return tuple(each._replace(pose=compose(to_base, each.pose)) for each in self.surfaces)

    def start_tcp(self) -> Transform:
        """Return the pose of the TCP in the base at the start."""
        return compose(arm_model(self.description).flange(self.start), self.tool_in_flange)

    def controller(self, tick_s: float, *, arm: Arm | None = None, **others: Any) -> Controller:
        """Return a new controller of the robot in this cell; other arguments are those of `Controller`.

        A robot that is not alone needs its `arm` of `shared_world`.
        """
        if arm is None and (world := shared_world([self], tick_s)) is not None:
            (arm,) = world.arms
        noise = None
        if self.noise is not None:
            noise = Noise(**structs.asdict(self.noise), joint_count=len(self.start))
        return Controller(
            self.description,
            tick_s,
            start=self.start,
            tool_in_flange=self.tool_in_flange,
            contact=TcpContact(self.seen(), self.contact_radius_m),
            noise=noise,
            io=Io(self.input_names, self.output_names),
            safety=self.safety,
            tool=self.tool,
            handled=self.handled,
            arm=arm,
            **others,
        )


def shared_world(cells: Sequence[Cell], tick_s: float) -> World | None:
    """Return the world of the robots in a cell; None for a single robot without gripper, parts and scene.

    Its `arms`, in the order of the robots, are what `Cell.controller` takes. Raises `CellFault` for parts
    and robots that are in each other.
    """
    handled = cells[0].handled
    if len(cells) == 1 and handled == NO_HANDLING:
        return None
    from iiwa_sim.world.build import ArmSetup  # MuJoCo takes 0.2 s to load
    from iiwa_sim.world.world import World

    arms = []
    for cell in cells:
        gripper = cell.handled.gripper and Gripper(cell.handled.gripper)
        shape = cell.tool_in_flange, cell.tool.capsules, cell.contact_radius_m
        arms.append(ArmSetup(cell.description, cell.start, *shape, gripper, cell.base, cell.name))
    scene = None if handled.scene is None else handled.scene.spec
    world = World(arms, cells[0].surfaces, handled.parts, scene, tick_s)
    for depth_m, *names in reversed(world.overlaps(CLOSE_M)):
        kinds = {each: world.kinds[each] for each in names}
        if set(kinds.values()) == {"robot"} or set(kinds.values()) <= {"part", "surface"}:
            one, two = sorted(n if kind == "robot" else f"{kind} {n!r}" for n, kind in kinds.items())
            expected = f"{one} at most {1e3 * CLOSE_M:g} mm inside {two} at the start"
            raise CellFault(str(cells[0].path), "", "", f"{expected}, not {1e3 * depth_m:.4g} mm")
    return world


def robot_alone(name_or_folder: str | Path = DEFAULT_ROBOT) -> Cell:
    """Return a cell with a robot at home and no surroundings; raises `RobotFault`."""
    description = load_robot(name_or_folder)
    return Cell(description, description.home, description.tool_in_flange)


def cells_of(robot: str | Path | None, cell: str | Path | None) -> tuple[Cell, ...]:
    """Return the cells of a robot by name or folder, or of a cell's file (.toml)."""
    if robot is not None and Path(robot).suffix == ".toml":
        robot, cell = None, robot
    if cell is None:
        return (robot_alone(DEFAULT_ROBOT if robot is None else robot),)
    return load_cells(cell)


def load_cells(path: str | Path) -> tuple[Cell, ...]:
    """Return the cell of a file, once for each robot in it.

    Raises `CellFault` if the file is missing or does not describe a cell, and `RobotFault` if a robot's
    folder cannot be used. A relative robot folder starts at the folder of the file.
    """
    file = Path(path)
    reader = Reader(str(file), CellFault)
    settings = reader.settings(CellSettings)
    surfaces = tuple(map(surface_of, settings.surfaces().values()))
    parts = tuple(
        part_of(each, reader.under(f"part[{index}]."), file.parent)
        for index, each in enumerate(settings.part)
    )
    taken = [*(each.name for each in surfaces), *(part.name for part, _ in parts)]
    scene = None if settings.scene is None else _scene(reader, file.parent, settings.scene.file, taken)
    cells = []
    for number, (prefix, robot) in enumerate(settings.robots().items()):
        its, noise, tool = reader.under(prefix), settings.noise, robot.tool_in_flange
        name = str(getattr(robot, "model", settings.robot))
        description = load_robot(name if name in built_in_robots() else file.parent / name)
        cell = Cell(
            description=description,
            start=_start(its, robot.start_deg, description),
            tool_in_flange=tool.to_transform() if tool else description.tool_in_flange,
            contact_radius_m=1e-3 * robot.contact_radius_mm,
            tool=NO_TOOL if robot.tool is None else robot.tool.tool(),
            handled=_handled(its, robot, parts, scene),
            surfaces=surfaces,
            noise=None if noise is None else structs.replace(noise, seed=noise.seed + number),
            input_names=robot.io.names("input"),
            output_names=robot.io.names("output"),
            safety=robot.safety.safety(),
            path=file,
        )
        if isinstance(robot, RobotSettings):
            cell = replace(cell, name=robot.name, base=pose_of(robot), ports=robot.ports())
        _check_start(its, robot, cell)
        cells.append(cell)
    return tuple(cells)


def _scene(reader: Reader, folder: Path, name: str, taken: Sequence[str]) -> Scene:
    """Read a scene, relative to the folder of the cell; `taken` are names of surfaces and parts."""
    from iiwa_sim.world.scene import Scene

    file = folder / name
    reader.check("scene.file", name, file.is_file(), f"the path of an MJCF file in {folder.resolve()}")
    try:
        scene = Scene(file)
    except (ValueError, OSError) as fault:
        raise CellFault(str(file), "", "", f"a scene that MuJoCo takes: {fault}") from None
    both = next((each for each in taken if each in scene.body_names), None)
    reader.check("scene.file", name, both is None, f"no body {both!r}: a surface or part has that name")
    return scene


def _handled(
    reader: Reader,
    robot: OneRobotSettings,
    parts: tuple[tuple[Part, Transform], ...],
    scene: Scene | None,
) -> HandlingSetup:
    """Return the gripper, the parts and the scene."""
    kind, wiring = NO_HANDLING[:2] if robot.gripper is None else robot.gripper.gripper()
    sensors, drivable = ((), ()) if scene is None else (scene.sensors, scene.drivable)
    wired = {f"input[{k}].sensor": (each.sensor, "a sensor", sensors) for k, each in enumerate(robot.input)}
    kinds = "an actuator, an equality, or a geom with surfacevel,"
    wired |= {f"output[{k}].actuator": (w.actuator, kinds, drivable) for k, w in enumerate(robot.output)}
    for key, (name, kind_of, names) in wired.items():
        near = get_close_matches(name, names, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(names) or 'none'}"
        reader.check(key, name, name in names, f"{kind_of} of the [scene]: {hint}")
    if scene is None:
        return HandlingSetup(kind, wiring, parts)
    inputs = [InputWire(w.number, *scene.sensor(w.sensor), w.above, w.below) for w in robot.input]
    outputs = [OutputWire(w.number, *scene.driven(w.actuator), w.on, w.off) for w in robot.output]
    return HandlingSetup(kind, wiring, parts, scene, tuple(inputs), tuple(outputs))


def _start(reader: Reader, start_deg: str | list[float], description: RobotDescription) -> tuple[float, ...]:
    if isinstance(start_deg, str):
        return description.home
    joints, least, most = description.joints, description.position_min, description.position_max
    reader.check(
        "start_deg", start_deg, len(start_deg) == len(joints), f"{len(joints)} values, one per joint"
    )
    start = tuple(map(radians, start_deg))
    for axis, (low, value, high) in enumerate(zip(least, start, most, strict=True)):
        within = f"a position within {joints[axis]}'s {degrees(low):.9g} to {degrees(high):.9g} deg"
        reader.check(f"start_deg[{axis}]", start_deg[axis], low <= value <= high, within)
    return start


def _check_start(reader: Reader, settings: OneRobotSettings, cell: Cell) -> None:
    """Check that the TCP starts in the box of [safety] and outside of surfaces; its sphere may touch them."""
    x, y, z = cell.start_tcp().translation
    for axis, low, at, high in zip("xyz", cell.safety.box[0], (x, y, z), cell.safety.box[1], strict=True):
        within = f"a pose with the TCP in the box of [safety], not at {axis} {1e3 * at:.1f} mm"
        reader.check("start_deg", settings.start_deg, low <= at <= high, within)
    for surface in cell.seen():
        depth_mm = -1e3 * surface.nearest(x, y, z)[0]
        outside = f"a pose with the TCP outside of surface {surface.name!r}, not {depth_mm:.3f} mm within it"
        reader.check("start_deg", settings.start_deg, depth_mm <= 0.0, outside)


def summary(cells: Sequence[Cell]) -> str:
    """Return lines on each robot for its author; raises `CellFault` for bodies that are in each other."""
    world, lines = shared_world(cells, 0.002), []
    for cell in cells:
        tcp, scene, parts = cell.start_tcp(), cell.handled.scene, cell.handled.parts
        frame = " ".join(f"{round(each, 3) + 0.0:.7g}" for each in Frame.from_transform(tcp))
        lines.append(f"robot {cell.name}".rstrip() + f": {cell.description.name}, its TCP starts at {frame}")
        if gripper := cell.handled.gripper:
            lines.append(f"gripper: {type(gripper).__name__.lower()} of {gripper.force_n:g} N")
        lines += [] if scene is None else [f"scene: {', '.join(each.name for each in scene.bodies)}"]
        lines += [f"part {part.name!r} {world.state(n)}" for n, (part, _) in enumerate(parts) if world]
        for each in cell.seen():
            away_mm = 1e3 * (each.nearest(*tcp.translation)[0] - cell.contact_radius_m)
            where = f"{away_mm:.2f} mm away" if away_mm >= 0.0 else f"pressed in by {-away_mm:.2f} mm"
            lines.append(f"{type(each.shape).__name__.lower()} {each.name!r}: {where}")
    return "".join(f"{harmless(line)}\n" for line in lines)
