"""The cell as values of JSON, for viewers and recordings."""

from collections.abc import Sequence
from typing import Any

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame, Transform, Vector
from iiwa_sim.world.gripper import Jaws
from iiwa_sim.world.part import Mesh, Part


def described_cell(controller: Controller) -> dict[str, Any]:
    """Return the surroundings of the arm as they are now, with the keys and units of a cell.toml.

    `jaw_mm` is along x y z of the TCP, and empty without jaws. Parts and bodies have shapes; a state has
    their places. The capsules of the tool are in the flange.
    """
    contact, io, tool, handling = controller.load.contact, controller.io, controller.tool, controller.handling
    gripper = None if handling is None or handling.gripper is None else handling.gripper.kind
    scene = None if handling is None else handling.scene
    return {
        "contact_radius_mm": 1e3 * contact.radius_m,
        "inputs": io.input_names,
        "outputs": io.output_names,
        "surfaces": list(map(_surface, contact.surfaces.values())),
        "parts": [{"name": part.name, **_shape(part.shape)} for part in parts_of(controller)],
        "bodies": [
            {"name": body.name, "shapes": [_shape(*each) for each in body.shapes]}
            for body in (() if scene is None else scene.bodies)
        ],
        "jaw_mm": _mm(gripper.jaw_m) if isinstance(gripper, Jaws) else (),
        "tool_capsules": [
            {"start_mm": _mm(each.start), "end_mm": _mm(each.end), "radius_mm": 1e3 * each.radius_m}
            for each in tool.capsules
        ],
    }


def parts_of(controller: Controller) -> list[Part]:
    """Return the parts that are there, in the order in which the cell names them."""
    return [] if controller.handling is None else controller.handling.bodies


def _surface(surface: Surface) -> dict[str, Any]:
    """Return a surface with the keys of a cell.toml: `iiwa_sim.cell.bodies.surface_of` reversed."""
    carries = {"surface_velocity_mm_per_s": _mm(surface.surface_velocity)}
    return {
        "name": surface.name,
        **_shape(surface.shape, surface.pose),
        "stiffness_n_per_m": surface.stiffness,
        "damping_s_per_m": surface.damping,
        "friction": surface.friction,
        **(carries if isinstance(surface.shape, Box) else {}),
    }


def _shape(
    shape: Shape | Mesh, pose: Transform | None = None, colour: Sequence[float] = ()
) -> dict[str, Any]:
    """Return the keys of a cell.toml for a shape (mm); of a mesh the corners of its triangles."""
    keys: dict[str, Any] = {"shape": type(shape).__name__.lower()}
    keys |= {} if pose is None else Frame.from_transform(pose)._asdict()
    keys |= {"colour": colour} if colour else {}
    match shape:
        case Mesh():
            keys["corners_mm"] = list(map(_mm, shape.corners))
        case Box():
            keys["size_mm"] = _mm((2.0 * shape.half_x, 2.0 * shape.half_y, 2.0 * shape.half_z))
        case Sphere():
            keys["radius_mm"] = 1e3 * shape.radius
        case Cylinder():
            keys |= {"radius_mm": 1e3 * shape.radius, "length_mm": 2e3 * shape.half_z}
    return keys


def _mm(place: Vector) -> Vector:
    x, y, z = place
    return (1e3 * x, 1e3 * y, 1e3 * z)
