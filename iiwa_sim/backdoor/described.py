"""Arm and cell as data for viewers: the arm, surfaces, parts and tool."""

from typing import TYPE_CHECKING, Any

import msgspec

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame, Vector
from iiwa_sim.world.gripper import Jaws
from iiwa_sim.world.part import Mesh, Part

if TYPE_CHECKING:
    from iiwa_sim.world.scene import SceneBody


class DescribedRobot(msgspec.Struct, frozen=True):
    """The arm, by fields of `RobotDescription`. One value per joint, base first."""

    name: str
    joints: tuple[str, ...]
    """Names of the joints in the URDF."""
    flange: str
    """The link of the URDF that is the flange."""
    position_min: tuple[float, ...]
    """rad"""
    position_max: tuple[float, ...]
    """rad"""
    velocity: tuple[float, ...]
    """Limits, rad/s."""
    urdf: str
    """The text of the URDF."""
    urdf_path: str
    """The path of the URDF on the robot's machine."""


class DescribedCapsule(msgspec.Struct, frozen=True):
    """One of `[tool] capsules_mm`, in the flange."""

    start_mm: Vector
    """One end of its line."""
    end_mm: Vector
    """The other one."""
    radius_mm: float


class DescribedCell(msgspec.Struct, frozen=True):
    """The surroundings of the arm, with the keys and units of a cell.toml."""

    contact_radius_mm: float
    """Radius of the sphere round the TCP that touches surfaces."""
    inputs: tuple[str, ...]
    """Names of the digital inputs, from number 1 on."""
    outputs: tuple[str, ...]
    surfaces: tuple[dict[str, object], ...]
    """The surfaces as they stand now: `shape` is plane, box, sphere or cylinder."""
    parts: tuple[dict[str, object], ...]
    """Shapes of the parts: `name`, `shape`, its lengths. A state has their places."""
    bodies: tuple[dict[str, object], ...]
    """Bodies of the scene: `name`, and `shapes`, each with its pose in the body and `colour` (r, g, b, a)."""
    jaw_mm: tuple[float, ...]
    """Size of each jaw of the gripper, along x y z of the TCP; empty without a gripper."""
    tool_capsules: tuple[DescribedCapsule, ...]
    """The shape of the tool; empty without any."""


class DescribedMove(msgspec.Struct, frozen=True):
    """A move, or a servo's target."""

    number: int
    """Moves are numbered in the order in which they were accepted."""
    goal_joint_position: tuple[float, ...]
    """rad, where it ends."""
    goal_frame: Frame
    """The TCP there, in the base: mm, rad."""
    blending_mm: float
    """Radius of the sphere round that place in which it may leave its path for the next move; 0 for none."""


class DescribedMoves(msgspec.Struct, frozen=True):
    """Moves that run and wait."""

    count: int
    """The number of all moves that run and wait."""
    moves: tuple[DescribedMove, ...]
    """The first ones, in the order in which they are done: what is being stopped, and holds, are left out."""


def described_moves(controller: Controller, at_most: int) -> DescribedMoves:
    """Describe what runs and what waits, `at_most` the first ones."""
    planned = controller.motions.planned
    moves = [
        DescribedMove(each.number, each.joints, controller.tool_frame(each.joints), 1e3 * each.blending_m)
        for each in planned[:at_most]
    ]
    return DescribedMoves(len(planned), tuple(moves))


def described_robot(controller: Controller) -> DescribedRobot:
    """The arm of a controller."""
    return msgspec.convert(controller.description, DescribedRobot, from_attributes=True)


def described_cell(controller: Controller) -> DescribedCell:
    """Return the present surroundings."""
    world, io, tool = controller.load.world, controller.io, controller.tool
    return DescribedCell(
        contact_radius_mm=1e3 * world.radius_m,
        inputs=io.input_names,
        outputs=io.output_names,
        surfaces=tuple(map(described_surface, world.surfaces.values())),
        parts=tuple(
            {"name": part.name, "shape": _kind(part.shape), **_lengths(part.shape)}
            for part in parts_of(controller)
        ),
        bodies=tuple(map(_described_body, bodies_of(controller))),
        jaw_mm=tuple(1e3 * each for each in jaw_m_of(controller)),
        tool_capsules=tuple(
            DescribedCapsule(_mm(each.start), _mm(each.end), 1e3 * each.radius_m)
            for each in (() if tool is None else tool.capsules)
        ),
    )


def parts_of(controller: Controller) -> list[Part]:
    """The parts that are there, in the order in which the cell names them."""
    return [] if controller.handling is None else controller.handling.bodies


def bodies_of(controller: Controller) -> "tuple[SceneBody, ...]":
    """Return what the bodies of the scene look like."""
    return () if controller.handling is None else controller.handling.scene_shapes


def jaw_m_of(controller: Controller) -> tuple[float, ...]:
    """Size of each jaw of its gripper, along x y z of the TCP (m); empty without a gripper."""
    handling = controller.handling
    kind = None if handling is None or handling.gripper is None else handling.gripper.kind
    return kind.jaw_m if isinstance(kind, Jaws) else ()


def described_surface(surface: Surface) -> dict[str, Any]:
    """Return a surface with the keys and units of a cell.toml: `iiwa_sim.cell.cell.surface_of` reversed."""
    carries = {"surface_velocity_mm_per_s": _mm(surface.surface_velocity)}
    return {
        "shape": _kind(surface.shape),
        "name": surface.name,
        **Frame.from_transform(surface.pose)._asdict(),
        "stiffness_n_per_m": surface.stiffness,
        "damping_s_per_m": surface.damping,
        "friction": surface.friction,
        **_lengths(surface.shape),
        **(carries if isinstance(surface.shape, Box) else {}),
    }


def _described_body(body: "SceneBody") -> dict[str, object]:
    shapes = [
        {
            "shape": _kind(shape),
            **_lengths(shape),
            **Frame.from_transform(pose)._asdict(),
            "colour": colour,
        }
        for shape, pose, colour in body.shapes
    ]
    return {"name": body.name, "shapes": shapes}


def _mm(place: Vector) -> Vector:
    x, y, z = place
    return (1e3 * x, 1e3 * y, 1e3 * z)


def _kind(shape: Shape | Mesh) -> str:
    return type(shape).__name__.lower()


def _lengths(shape: Shape | Mesh) -> dict[str, Any]:
    """The keys of a cell.toml for the lengths of a shape (mm); of a mesh the corners of its triangles."""
    match shape:
        case Mesh():
            return {"corners_mm": tuple(map(_mm, shape.corners))}
        case Box():
            return {"size_mm": (2e3 * shape.half_x, 2e3 * shape.half_y, 2e3 * shape.half_z)}
        case Sphere():
            return {"radius_mm": 1e3 * shape.radius}
        case Cylinder():
            return {"radius_mm": 1e3 * shape.radius, "length_mm": 2e3 * shape.half_z}
    return {}
