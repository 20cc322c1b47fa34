"""A robot and its cell in viser's scene."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Mapping, Sequence
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.visual.material import PBRMaterial

from iiwa_sim.frames import (
    IDENTITY,
    Frame,
    Rotation,
    Transform,
    Vector,
    apply,
    compose,
    inverse,
    quaternion_from_rotation,
)
from iiwa_sim.robot.description import built_in_robots, load_robot
from iiwa_sim.robot.meshes import LinkMesh, link_meshes
from iiwa_sim.robot.model import GREY, ArmModel, Shape
from iiwa_sim.world.gripper import JAW_M

if TYPE_CHECKING:
    import viser

logger = logging.getLogger(__name__)

State = Mapping[str, Any]
"""A state of the robot, with the keys and units of protocol/status.schema.json."""
Colour = tuple[int, int, int]

BODY, TOOL, HELD, SURFACE = (215, 150, 65), (112, 115, 122), (47, 158, 68), (120, 150, 140)
JAW, FORCE, TORQUE, CONTACT = (70, 72, 78), (230, 90, 20), (150, 60, 200), (230, 30, 30)
ROD_M, SHORTEST_ROD_M = 0.03, 0.01
"""Radius of the rod for a link without shapes, and the shortest one that is drawn."""
M_PER_N, M_PER_NM, LONGEST_ARROW_M = 0.005, 0.02, 0.5
LEAST_N, LEAST_NM = 0.5, 0.1
MOST_CONTACTS = 4
PLANE_M, THIN_M = 2.0, 0.002
TRAIL_S, TRAIL_STEP_M, TRAIL_JUMP_M, TRAIL_POINTS = 10.0, 0.004, 0.5, 400
TRAIL = (60, 90, 220)


class Robot(msgspec.Struct, frozen=True):
    """The arm, by fields of `RobotDescription`; the backdoor's `get robot` has them, too."""

    name: str
    joints: tuple[str, ...]
    flange: str
    position_min: tuple[float, ...]
    """rad"""
    position_max: tuple[float, ...]
    urdf: str
    urdf_path: str = ""

    def meshes(self) -> dict[str, list[LinkMesh]]:
        """Return the meshes of links that this machine has: beside the URDF, or of a built-in robot."""
        if Path(self.urdf_path).is_file():
            return link_meshes(self.urdf, self.urdf_path)
        built_in = [robot for robot in map(load_robot, built_in_robots()) if robot.urdf == self.urdf]
        return link_meshes(self.urdf, built_in[0].urdf_path) if built_in else {}


class Arm:
    """The links of a robot: their poses, and their looks as glTF."""

    def __init__(self, robot: Robot) -> None:
        """Raises RobotFault for a URDF that is not one of this robot."""
        model = ArmModel(robot.urdf, robot.joints, robot.flange, "the robot's URDF", "the robot")
        self.links = model.links
        self.flange = [link.name for link in self.links].index(robot.flange)
        meshes = robot.meshes()
        self.looks = [self._look(index, meshes.get(link.name, ())) for index, link in enumerate(self.links)]
        """For each link glTF: its meshes, else its shapes, else rods to its children; None without these."""

    def poses(self, joints: Sequence[float]) -> list[Transform]:
        """Return the poses of all links in the base (m) at joint positions (rad)."""
        found: list[Transform] = []
        for link in self.links:
            pose = link.pose_at(joints)
            found.append(pose if link.parent is None else compose(found[link.parent], pose))
        return found

    def _look(self, index: int, meshes: Sequence[LinkMesh]) -> bytes | None:
        if len(meshes) == 1 and meshes[0] == LinkMesh(meshes[0].path) and meshes[0].path.suffix == ".glb":
            return meshes[0].path.read_bytes()  # with its normals
        link, look = self.links[index], trimesh.Scene()
        for mesh in meshes:
            try:
                loaded: list[Any] = trimesh.load_scene(mesh.path).dump()
            except Exception as fault:  # noqa: BLE001 - of any reader of files
                logger.warning("%s is not shown: %s", mesh.path, fault)
                continue
            for each in loaded:
                if mesh.colour or not isinstance(getattr(each.visual, "material", None), PBRMaterial):
                    _paint(each, mesh.colour or GREY)
                look.add_geometry(each, transform=_matrix(mesh.pose) @ np.diag([*mesh.scale, 1.0]))
        for shape in () if look.geometry else link.visual:
            solid = _solid(shape)
            _paint(solid, shape.colour)
            look.add_geometry(solid, transform=_matrix(shape.pose))
        ends = [each.pose.translation for each in self.links if each.parent == index]
        for end in () if look.geometry else ends:
            if hypot(*end) >= SHORTEST_ROD_M:
                rod: Any = trimesh.creation.cylinder(ROD_M, segment=[(0.0, 0.0, 0.0), end])
                _paint(rod, GREY)
                look.add_geometry(rod)
        return bytes(look.export(file_type="glb")) if look.geometry else None  # type: ignore[no-untyped-call]


class Scene:
    """Arm, cell, frames, path of the TCP and wrench of one robot below a node."""

    def __init__(
        self, scene: viser.SceneApi, robot: Robot, root: str = "/robot", place: Transform = IDENTITY
    ):
        """Raises RobotFault for a robot that cannot be drawn. `place` is the pose of its base."""
        self.arm = Arm(robot)
        self.root = root
        self.place = place
        scene.add_frame(root, show_axes=False, position=place.translation, wxyz=wxyz(place.rotation))
        self.handles: list[Any] = []
        """Nodes of the links, each below its parent's."""
        for link, look in zip(self.arm.links, self.arm.looks, strict=True):
            above = f"{root}/arm" if link.parent is None else self.handles[link.parent].name
            path, pose = f"{above}/{link.name.replace('/', '_')}", link.pose
            at: dict[str, Any] = {"position": pose.translation, "wxyz": wxyz(pose.rotation)}
            if look is None:
                self.handles.append(scene.add_frame(path, show_axes=False, **at))
            else:
                self.handles.append(scene.add_glb(path, look, **at))
        scene.add_frame(f"{root}/base", axes_length=0.15, axes_radius=0.004)
        self._tcp: Any = scene.add_frame(f"{root}/tcp", axes_length=0.08, axes_radius=0.003)
        self._arrows = [
            _arrow(scene, f"{root}/tcp/{name}", c) for name, c in (("force", FORCE), ("torque", TORQUE))
        ]
        self._contacts = [
            scene.add_icosphere(f"{root}/contact/{number}", radius=0.015, color=CONTACT, visible=False)
            for number in range(MOST_CONTACTS)
        ]
        flange = str(self.handles[self.arm.flange].name)
        self._tool: Any = line(scene, f"{flange}/tool", (90, 90, 90), 5.0)
        self.trail = Trail(scene, f"{root}/trail")
        self._surfaces = Bodies(scene, f"{root}/cell", SURFACE, 0.6)
        self._tool_body = Bodies(scene, f"{flange}/tool_body", TOOL)
        self._parts = Bodies(scene, f"{root}/parts", BODY)
        self._bodies = Bodies(scene, f"{root}/scene", SURFACE)
        self._jaws = Bodies(scene, f"{root}/tcp/jaws", JAW)
        self.cell: Mapping[str, Any] = {}

    def show(self, state: State) -> None:
        """Draw a state. A `time_s` before that of the last one clears the path."""
        joints = state["joint_position"]
        flange, tcp = Frame(*state["flange_frame"]).to_transform(), Frame(*state["tool_frame"]).to_transform()
        for link, handle in zip(self.arm.links, self.handles, strict=True):
            if link.joint is not None:
                handle.wxyz = wxyz(link.pose_at(joints).rotation)
        _place(self._tcp, tcp)
        tool = compose(inverse(flange), tcp).translation
        self._tool.points = np.round([[(0.0, 0.0, 0.0), tool]], 4)
        self.trail.add(state["time_s"], tcp.translation)
        self._show_gripper(state.get("gripper"))
        for part in state.get("parts", ()):
            if (body := self._parts.get(part["name"])) is not None:
                _place(body, Frame(*part["frame"]).to_transform())
                body.color = HELD if part["state"] == "held" else BODY
        for each in state.get("bodies", ()):
            if (body := self._bodies.get(each["name"])) is not None:
                _place(body, Frame(*each["frame"]).to_transform())
        wrench = np.array(state["cartesian_force"])
        for arrow, vector, least, metres in zip(
            self._arrows, (wrench[:3], wrench[3:]), (LEAST_N, LEAST_NM), (M_PER_N, M_PER_NM), strict=True
        ):
            size = float(np.linalg.norm(vector))
            arrow.visible = size >= least
            if arrow.visible:
                arrow.points = np.round([[(0.0, 0.0, 0.0), min(metres, LONGEST_ARROW_M / size) * vector]], 3)
        touches = [np.array(each["point"]) for each in state.get("link_touches", ())][:MOST_CONTACTS]
        for number, mark in enumerate(self._contacts):
            mark.visible = number < len(touches)
            if mark.visible:
                mark.position = 1e-3 * touches[number]

    def show_cell(self, cell: Mapping[str, Any]) -> None:
        """Draw the cell, as the backdoor's `get cell` describes it."""
        if cell == self.cell:
            return
        self.cell = cell
        self._surfaces.set(cell["surfaces"])
        self._parts.set(cell.get("parts", ()))
        self._bodies.set(cell.get("bodies", ()))
        self._tool_body.set(_capsules(cell.get("tool_capsules", ())))
        self._jaws.set(())

    def points(self, joints: Sequence[float]) -> NDArray[np.float64]:
        """Return points (n, 3; m) of the scene that a picture of arm and cell should show."""
        arm = [pose.translation for pose in self.arm.poses(joints)]
        bodies = [handle.position for handle in (*self._surfaces.values(), *self._parts.values())]
        near = [each for each in bodies if np.linalg.norm(each) < 1.5]
        return np.array([apply(self.place, tuple(each)) for each in (*arm, *near)], float)

    def tcp(self) -> NDArray[np.float64]:
        """Return the position of the TCP in the scene (m)."""
        return np.array(apply(self.place, tuple(self._tcp.position)))

    def _show_gripper(self, gripper: Mapping[str, Any] | None) -> None:
        if gripper is None:
            return
        size_mm = self.cell.get("jaw_mm") or [1e3 * each for each in JAW_M]
        if not self._jaws:
            self._jaws.set([{"name": name, "shape": "box", "size_mm": size_mm} for name in ("1", "2")])
        away = 5e-4 * (gripper["opening_mm"] + size_mm[1])
        for side, body in zip((1.0, -1.0), self._jaws.values(), strict=True):
            body.position = (0.0, side * away, -5e-4 * size_mm[2])
            body.color = HELD if gripper["state"] == "holds" else JAW


class Bodies(dict[str, Any]):
    """Handles of simple bodies below a node, by name."""

    def __init__(
        self, scene: viser.SceneApi, root: str, colour: Colour, opacity: float | None = None
    ) -> None:
        super().__init__()
        self._scene, self._root = scene, root
        self._look: dict[str, Any] = {"color": colour, "opacity": opacity, "cast_shadow": False}
        self._numbers = 0

    def set(self, bodies: Sequence[Mapping[str, Any]]) -> None:
        """Show these bodies and no others, each by keys of a cell.toml, in mm, or with several `shapes`."""
        for handle in self.values():
            handle.remove()
        self.clear()
        for body in bodies:
            self._numbers += 1
            path = f"{self._root}/{self._numbers}"
            if "shapes" in body:
                self[str(body["name"])] = self._scene.add_frame(path, show_axes=False)
                for number, shape in enumerate(body["shapes"]):
                    self._added(f"{path}/{number}", shape)
            else:
                self[str(body["name"])] = self._added(path, body)

    def _added(self, path: str, body: Mapping[str, Any]) -> Any:
        handle = self._shown(path, body)
        if "x_mm" in body:
            _place(handle, Frame(*(float(body[key]) for key in Frame._fields)).to_transform())
        return handle

    def _shown(self, path: str, body: Mapping[str, Any]) -> Any:
        scene, look = self._scene, self._look
        if "colour" in body:
            *colour, alpha = body["colour"]
            opacity = None if alpha == 1.0 else alpha
            look = {**look, "color": tuple(round(255 * each) for each in colour), "opacity": opacity}
        match body["shape"]:
            case "plane":
                return scene.add_box(path, dimensions=(PLANE_M, PLANE_M, THIN_M), **look)
            case "box":
                return scene.add_box(path, dimensions=1e-3 * np.array(body["size_mm"]), **look)
            case "mesh":
                corners = 1e-3 * np.array(body["corners_mm"])
                faces = np.arange(len(corners)).reshape(-1, 3)
                return scene.add_mesh_simple(path, corners, faces, side="double", **look)
            case "sphere":
                return scene.add_icosphere(path, radius=1e-3 * body["radius_mm"], **look)
        radius_m, length_m = 1e-3 * body["radius_mm"], 1e-3 * body["length_mm"]
        return scene.add_cylinder(path, radius=radius_m, height=length_m, **look)


class Trail:
    """Path of the TCP in the last `TRAIL_S` of simulated time."""

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        self._line: Any = line(scene, path, TRAIL, 3.0)
        self._line.visible = False
        self.points: deque[tuple[float, Vector]] = deque(maxlen=TRAIL_POINTS)

    def add(self, time_s: float, point: Vector) -> None:
        """Add a point (m). Time that goes back, and a jump, begin a new path."""
        step_m = float(np.linalg.norm(np.subtract(point, self.points[-1][1]))) if self.points else 0.0
        if self.points and (time_s < self.points[-1][0] or step_m > TRAIL_JUMP_M):
            self.points.clear()
        if not self.points or step_m > TRAIL_STEP_M:
            self.points.append((time_s, point))
        elif len(self.points) == 1:
            self.points[0] = (time_s, self.points[0][1])  # the path begins where the motion does
        while len(self.points) > 1 and time_s - self.points[0][0] > TRAIL_S:
            self.points.popleft()
        self._line.visible = len(self.points) > 1
        if self._line.visible:
            points = np.array([each for _, each in self.points])
            self._line.points = np.stack([points[:-1], points[1:]], axis=1)


def wxyz(rotation: Rotation) -> tuple[float, float, float, float]:
    """Return a rotation in the form that viser takes."""
    x, y, z, w = quaternion_from_rotation(rotation)
    return (w, x, y, z)


def line(scene: viser.SceneApi, path: str, colour: Colour, pixels: float) -> Any:
    """Add a line of one segment, to be moved later."""
    nothing = np.zeros((1, 2, 3), np.float32)
    return scene.add_line_segments(path, nothing, colour, thickness=pixels, thickness_units="screen")


def _arrow(scene: viser.SceneApi, path: str, colour: Colour) -> Any:
    points = np.array([[(0.0, 0.0, 0.0), (0.0, 0.0, 0.1)]], np.float32)
    sizes: dict[str, Any] = {"shaft_radius": 0.006, "head_radius": 0.016, "head_length": 0.035}
    return scene.add_arrows(path, points, colour, visible=False, **sizes)


def _place(handle: Any, pose: Transform) -> None:
    handle.position, handle.wxyz = pose.translation, wxyz(pose.rotation)


def _matrix(pose: Transform) -> NDArray[np.float64]:
    rotation = np.array(pose.rotation).reshape(3, 3)
    return np.block([[rotation, np.array([pose.translation]).T], [np.zeros(3), 1.0]])


def _solid(shape: Shape) -> Any:
    if shape.kind == "box":
        return trimesh.creation.box(shape.size_m)
    if shape.kind == "sphere":
        return trimesh.creation.icosphere(3, shape.size_m[0])
    return trimesh.creation.cylinder(shape.size_m[0], shape.size_m[1], sections=32)


def _paint(mesh: Any, colour: Sequence[float]) -> None:
    """Give a mesh one colour, sRGB from 0 to 1; glTF has linear ones."""
    linear = [each / 12.92 if each <= 0.04045 else ((each + 0.055) / 1.055) ** 2.4 for each in colour[:3]]
    matt: Any = {"metallicFactor": 0.0, "roughnessFactor": 0.6}
    material = PBRMaterial(baseColorFactor=[*linear, colour[3]], **matt)  # type: ignore[no-untyped-call]
    mesh.visual = trimesh.visual.TextureVisuals(material=material)  # type: ignore[no-untyped-call]


def _capsules(capsules: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the capsules of a tool as one body, a mesh in mm."""
    solids: list[Any] = []
    for each in capsules:
        ends = np.array([each["start_mm"], each["end_mm"]])
        if not np.array_equal(*ends):
            solids.append(trimesh.creation.cylinder(each["radius_mm"], segment=ends, sections=16))
        solids += [trimesh.creation.icosphere(2, each["radius_mm"]).apply_translation(end) for end in ends]
    if not solids:
        return []
    whole: Any = trimesh.util.concatenate(solids)
    return [{"name": "tool", "shape": "mesh", "corners_mm": whole.triangles.reshape(-1, 3)}]
