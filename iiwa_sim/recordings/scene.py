"""Arm and cell as simple shapes, for recordings and the page.

A shape has the keys of a cell.toml: `shape` (box, sphere, cylinder or mesh), lengths in mm, perhaps a pose,
and `colour`, red, green, blue and opacity from 0 to 1.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import hypot
from pathlib import Path
from typing import Any, NamedTuple

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.robot.description import RobotDescription, built_in_robots, load_robot
from iiwa_sim.robot.meshes import LinkMesh, link_meshes
from iiwa_sim.robot.model import GREY, Link, arm_model

BASE, FLANGE, TCP = "base", "flange", "tcp"
"""Frames of bodies that are fixed there; others have frames of their own."""
JAWS = {"jaw_1": 1.0, "jaw_2": -1.0}
"""Frames of the jaws of a gripper, and to which side of the TCP they open."""
SURFACE, TIP, PART = (0.47, 0.58, 0.55, 0.6), (0.9, 0.3, 0.1, 0.8), (0.85, 0.6, 0.25, 1.0)
JAW, TOOL = (0.28, 0.28, 0.3, 1.0), (0.45, 0.46, 0.48, 1.0)
PLANE_MM = (3000.0, 3000.0, 2.0)
"""The slab that a plane, which has no end, is drawn as."""
ROD_M, SHORTEST_ROD_M = 0.03, 0.01
"""Radius of the rod for a link without shapes, and the shortest one that is drawn."""

Shape = Mapping[str, Any]


class Body(NamedTuple):
    """Shapes that move together."""

    frame: str
    name: str
    shapes: Sequence[Shape]


class Arm:
    """The links of a robot and their looks."""

    def __init__(self, robot: RobotDescription) -> None:
        """Raises RobotFault for a URDF that is not one of this robot."""
        self.links = arm_model(robot).links
        self.base, self.flange = self.links[0].name, robot.flange
        path = robot.urdf_path
        if not Path(path).is_file():  # of a robot on another machine
            known = [each.urdf_path for each in map(load_robot, built_in_robots()) if each.urdf == robot.urdf]
            path = known[0] if known else path
        self.meshes: Mapping[str, Sequence[LinkMesh]] = link_meshes(robot.urdf, path)
        """The meshes of links that this machine has, by the name of the link."""

    def poses(self, joints: Sequence[float]) -> list[Transform]:
        """Return the poses of all links in the base (m) at joint positions (rad)."""
        found: list[Transform] = []
        for link in self.links:
            pose = link.pose_at(joints)
            found.append(pose if link.parent is None else compose(found[link.parent], pose))
        return found

    def shapes(self, link: Link) -> Iterator[Shape]:
        """Yield the shapes of a link without meshes, or rods to its children."""
        for each in link.visual:
            size = [1e3 * length for length in each.size_m]
            lengths = (
                {"size_mm": size} if each.kind == "box" else {"radius_mm": size[0], "length_mm": size[-1]}
            )
            yield {"shape": each.kind, "colour": each.colour, **lengths, **_frame(each.pose)}
        index = self.links.index(link)
        ends = [each.pose.translation for each in self.links if each.parent == index]
        for end in () if link.visual else ends:
            if hypot(*end) >= SHORTEST_ROD_M:
                yield from _shapes_of(Capsule("", 0, (0.0, 0.0, 0.0), end, ROD_M), GREY)


def bodies_of(cell: Mapping[str, Any], shows_cell: bool) -> Iterator[Body]:
    """Yield tool and jaws; if `shows_cell` also the sphere round the TCP and what robots share."""
    if cell["tool_capsules"]:
        ends = [(*each["start_mm"], *each["end_mm"], each["radius_mm"]) for each in cell["tool_capsules"]]
        shapes = [shape for each in ends for shape in _shapes_of(Capsule.of_mm(each), TOOL)]
        yield Body(FLANGE, "tool", shapes)
    for name, side in JAWS.items() if cell["jaw_mm"] else ():
        middle = Frame(0.0, side * 0.5 * cell["jaw_mm"][1], -0.5 * cell["jaw_mm"][2], 0.0, 0.0, 0.0)
        jaw = {"shape": "box", "size_mm": cell["jaw_mm"], **middle._asdict(), "colour": JAW}
        yield Body(name, name, [jaw])
    if not shows_cell:
        return
    if cell["surfaces"] and cell["contact_radius_mm"] > 0.0:
        yield Body(TCP, TCP, [{"shape": "sphere", "radius_mm": cell["contact_radius_mm"], "colour": TIP}])
    for each in cell["surfaces"]:
        yield Body(BASE, f"surface {each['name']}", [_slab(each) | {"colour": SURFACE}])
    for each in cell["parts"]:
        yield Body(f"part {each['name']}", f"part {each['name']}", [each | {"colour": PART}])
    for body in cell["bodies"]:
        yield Body(f"body {body['name']}", f"body {body['name']}", body["shapes"])


def moving_bodies(state: Snapshot) -> Iterator[tuple[str, Transform, bool]]:
    """Yield jaws (in the TCP), parts and bodies (in the base): name, pose, and True for one that is held."""
    if state.gripper is not None:
        for name, side in JAWS.items():
            away = Transform(IDENTITY.rotation, (0.0, side * 5e-4 * state.gripper.opening_mm, 0.0))
            yield name, away, state.gripper.state == "holds"
    for part in state.parts:
        yield f"part {part.name}", part.frame.to_transform(), part.state == "held"
    for body in state.bodies:
        yield f"body {body.name}", body.frame.to_transform(), False


def pose_of(shape: Shape) -> Transform:
    """Return the pose of a shape in its body (m)."""
    return Frame(*(shape[key] for key in Frame._fields)).to_transform() if "x_mm" in shape else IDENTITY


def _slab(surface: dict[str, Any]) -> dict[str, Any]:
    if surface["shape"] != "plane":
        return surface
    below = compose(pose_of(surface), Frame(0.0, 0.0, -0.5 * PLANE_MM[2], 0.0, 0.0, 0.0).to_transform())
    return {"shape": "box", "size_mm": PLANE_MM, **_frame(below)}


def _shapes_of(capsule: Capsule, colour: Sequence[float]) -> Iterator[Shape]:
    common = {"colour": colour, "radius_mm": 1e3 * capsule.radius_m}
    if capsule.length_m > 0.0:
        length_mm = 1e3 * capsule.length_m
        yield {**common, **_frame(capsule.pose), "shape": "cylinder", "length_mm": length_mm}
    for end in dict.fromkeys((capsule.start, capsule.end)):
        yield {**common, **_frame(Transform(IDENTITY.rotation, end)), "shape": "sphere"}


def _frame(pose: Transform) -> dict[str, float]:
    return Frame.from_transform(pose)._asdict()
