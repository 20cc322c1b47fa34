"""What stands there, as data for who looks at it from outside: the arm, and what is round it."""

from typing import Any, Self

import msgspec

from iiwa_sim.cell.surfaces import AnySurface, BoxSettings, CylinderSettings, PlaneSettings, SphereSettings
from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame, Vector
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.world.gripper import Jaws
from iiwa_sim.world.part import Mesh, Part


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

    @classmethod
    def of(cls, capsule: Capsule) -> Self:
        """A capsule as it is told."""
        (ax, ay, az), (bx, by, bz) = capsule.start, capsule.end
        ends_mm = (1e3 * ax, 1e3 * ay, 1e3 * az), (1e3 * bx, 1e3 * by, 1e3 * bz)
        return cls(*ends_mm, 1e3 * capsule.radius_m)


class DescribedCell(msgspec.Struct, frozen=True):
    """What is round the arm, with the keys and units of a cell.toml."""

    contact_radius_mm: float
    """Radius of the sphere round the TCP that touches surfaces."""
    inputs: tuple[str, ...]
    """Names of the digital inputs, from number 1 on."""
    outputs: tuple[str, ...]
    surfaces: tuple[dict[str, object], ...]
    """The surfaces as they stand now: `shape` is plane, box, sphere or cylinder."""
    parts: tuple[dict[str, object], ...]
    """What the parts that are there look like: `name`, `shape`, its lengths. A state tells where they are."""
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
    """What runs and what waits."""

    count: int
    """The number of all moves that run and wait."""
    moves: tuple[DescribedMove, ...]
    """The first ones, in the order in which they are done: what is being stopped, and holds, are left out."""


def described_moves(controller: Controller, at_most: int) -> DescribedMoves:
    """Describe what runs and what waits, `at_most` the first ones."""
    planned = controller.planned
    return DescribedMoves(
        len(planned),
        tuple(
            DescribedMove(
                move.number, move.joints, controller.tcp_frame_at(move.joints), 1e3 * move.blending_m
            )
            for move in planned[:at_most]
        ),
    )


def described_robot(controller: Controller) -> DescribedRobot:
    """The arm of a controller."""
    return msgspec.convert(controller.description, DescribedRobot, from_attributes=True)


def described_cell(controller: Controller) -> DescribedCell:
    """What is round it, as it is now."""
    world, io, tool = controller.load.world, controller.io, controller.tool
    return DescribedCell(
        contact_radius_mm=1e3 * world.radius_m,
        inputs=io.input_names,
        outputs=io.output_names,
        surfaces=tuple(msgspec.to_builtins(settings_of(surface)) for surface in world.surfaces.values()),
        parts=tuple(
            {"name": part.name, "shape": _kind(part.shape), **_lengths(part.shape)}
            for part in parts_of(controller)
        ),
        jaw_mm=tuple(1e3 * each for each in jaw_m_of(controller)),
        tool_capsules=() if tool is None else tuple(map(DescribedCapsule.of, tool.capsules)),
    )


def parts_of(controller: Controller) -> list[Part]:
    """The parts that are there, in the order in which the cell names them."""
    return [] if controller.handling is None else controller.handling.bodies


def jaw_m_of(controller: Controller) -> tuple[float, ...]:
    """Size of each jaw of its gripper, along x y z of the TCP (m); empty without a gripper."""
    handling = controller.handling
    kind = None if handling is None or handling.gripper is None else handling.gripper.kind
    return kind.jaw_m if isinstance(kind, Jaws) else ()


def settings_of(surface: Surface) -> AnySurface:
    """The settings of a cell.toml that describe a surface: `iiwa_sim.cell.cell.surface_of` reversed."""
    return _SETTINGS[_kind(surface.shape)](
        name=surface.name,
        stiffness_n_per_m=surface.stiffness,
        damping_s_per_m=surface.damping,
        friction=surface.friction,
        **Frame.from_transform(surface.pose)._asdict(),
        **_lengths(surface.shape),
        **_carries(surface),
    )


def _carries(surface: Surface) -> dict[str, Any]:
    x, y, z = surface.surface_velocity
    is_box = isinstance(surface.shape, Box)
    return {"surface_velocity_mm_per_s": (1e3 * x, 1e3 * y, 1e3 * z)} if is_box else {}


def _kind(shape: Shape | Mesh) -> str:
    return type(shape).__name__.lower()


def _lengths(shape: Shape | Mesh) -> dict[str, Any]:
    """The keys of a cell.toml for the lengths of a shape (mm); of a mesh the corners of its triangles."""
    match shape:
        case Mesh():
            return {"corners_mm": tuple((1e3 * x, 1e3 * y, 1e3 * z) for x, y, z in shape.corners)}
        case Box():
            return {"size_mm": (2e3 * shape.half_x, 2e3 * shape.half_y, 2e3 * shape.half_z)}
        case Sphere():
            return {"radius_mm": 1e3 * shape.radius}
        case Cylinder():
            return {"radius_mm": 1e3 * shape.radius, "length_mm": 2e3 * shape.half_z}
    return {}


_SETTINGS: dict[str, type[AnySurface]] = {
    "plane": PlaneSettings,
    "box": BoxSettings,
    "sphere": SphereSettings,
    "cylinder": CylinderSettings,
}
