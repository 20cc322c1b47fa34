"""A robot and its cell in viser's scene."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from math import dist
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, quaternion_from_rotation
from iiwa_sim.recordings.scene import BASE, FLANGE, JAWS, TCP, Arm, Shape, bodies_of, moving_bodies, pose_of
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.meshes import LinkMesh
from iiwa_sim.robot.model import GREY

if TYPE_CHECKING:
    import viser

logger = logging.getLogger(__name__)

HELD = (0.18, 0.62, 0.27, 1.0)
FORCE, CONTACT, TRAIL, TOOL = (230, 90, 20), (230, 30, 30), (60, 90, 220), (90, 90, 90)
M_PER_N, LONGEST_ARROW_M, LEAST_N = 0.005, 0.5, 0.5
MOST_CONTACTS = 4
TRAIL_STEP_M, TRAIL_POINTS, TRAIL_JUMP_S = 0.004, 400, 2.0
FASTEST_M_S = 5.0
"""A TCP that is faster was put elsewhere by the backdoor."""
FAR_M = 1.5
"""Distance from the base beyond which bodies do not count for the camera."""


class Scene:
    """Arm, cell, frames, path of the TCP and wrench of one robot below a node."""

    def __init__(
        self,
        scene: viser.SceneApi,
        robot: RobotDescription,
        root: str = "/robot",
        place: Transform = IDENTITY,
        shows_cell: bool = True,
    ) -> None:
        """Raises RobotFault for a robot that cannot be drawn.

        `place` is the pose of its base; one of the robots of a cell shows their shared bodies.
        """
        self._scene, self.root, self.place, self._shows_cell = scene, root, place, shows_cell
        self._arm = arm = Arm(robot)
        self._frame(root, place)
        self._links: list[Any] = []
        self.handles: list[Any] = []
        """Nodes of the arm that a viewer can click and drag."""
        for link in arm.links:
            path = f"{root}/arm/{link.name.replace('/', '_')}"
            self._links.append(self._frame(path))
            meshes = enumerate(arm.meshes.get(link.name, ()))
            shown = [self._add_mesh(f"{path}/{number}", mesh) for number, mesh in meshes]
            self.handles += [each for each in shown or self._add_shapes(path, arm.shapes(link)) if each]
        scene.add_frame(f"{root}/base", axes_length=0.15, axes_radius=0.004)
        self._tcp: Any = scene.add_frame(f"{root}/tcp", axes_length=0.08, axes_radius=0.003)
        flange = f"{root}/arm/{arm.flange.replace('/', '_')}/body"
        self._parents = {BASE: f"{root}/cell", FLANGE: flange, TCP: f"{root}/tcp/body"}
        self._parents |= dict.fromkeys(JAWS, f"{root}/tcp/jaws")
        sizes: dict[str, Any] = {"shaft_radius": 0.006, "head_radius": 0.016, "head_length": 0.035}
        points = np.zeros((1, 2, 3), np.float32)
        self._force: Any = scene.add_arrows(f"{root}/tcp/force", points, FORCE, visible=False, **sizes)
        self._contacts = [
            scene.add_icosphere(f"{root}/contact/{number}", radius=0.015, color=CONTACT, visible=False)
            for number in range(MOST_CONTACTS)
        ]
        self._tool, self._trail = self._line(f"{root}/tool", TOOL), self._line(f"{root}/trail", TRAIL)
        self._path: deque[Vector] = deque(maxlen=TRAIL_POINTS)
        self._bodies: dict[str, tuple[Any, list[Any], Sequence[Shape]]] = {}  # node, its shapes as drawn
        self._count = 0
        self._cell: Mapping[str, Any] = {}
        self._state: Snapshot | None = None

    def show(self, state: Snapshot, cell: Mapping[str, Any]) -> None:
        """Draw a state, and the cell as the backdoor describes it."""
        if state is self._state:
            return
        if cell != self._cell:
            self._show_cell(cell)
        before_s = state.time_s if self._state is None else self._state.time_s
        self._state, self._cell = state, cell
        tcp = state.tool_frame.to_transform()
        for node, pose in zip(self._links, self._arm.poses(state.joint_position), strict=True):
            _place(node, pose)
        _place(self._tcp, tcp)
        self._tool.points = 1e-3 * np.round([[state.flange_frame[:3], state.tool_frame[:3]]], 1)
        self._add_to_path(state.time_s - before_s, tcp.translation)
        for name, pose, is_held in moving_bodies(state):
            if name in self._bodies:
                node, nodes, shapes = self._bodies[name]
                _place(node, pose)
                for each, shape in zip(nodes, shapes, strict=True):
                    each.color = _rgb(HELD if is_held else shape["colour"])
        force = np.array(state.cartesian_force[:3])
        force_n = float(np.linalg.norm(force))
        self._force.visible = force_n >= LEAST_N
        if self._force.visible:
            arrow = min(M_PER_N, LONGEST_ARROW_M / force_n) * force
            self._force.points = np.round([[(0.0, 0.0, 0.0), arrow]], 3)
        for number, mark in enumerate(self._contacts):
            mark.visible = number < len(state.link_touches)
            if mark.visible:
                mark.position = 1e-3 * np.array(state.link_touches[number].point)

    def _show_cell(self, cell: Mapping[str, Any]) -> None:
        for node, *_ in self._bodies.values():
            node.remove()
        self._bodies = {}
        for body in bodies_of(cell, self._shows_cell):
            self._count += 1  # a node that is removed and added within one frame keeps its old look
            path = f"{self._parents.get(body.frame, f'{self.root}/bodies')}/{self._count}"
            self._bodies[body.name] = self._frame(path), self._add_shapes(path, body.shapes), body.shapes

    def points(self) -> NDArray[np.float64]:
        """Return points (n, 3; m) of drawn shapes that a picture of arm and cell should show."""
        points = [tuple(node.position) for node in self._links]
        for node, shapes, _ in self._bodies.values():
            points += [tuple(np.add(node.position, shape.position)) for shape in shapes]
        return np.array([apply(self.place, each) for each in points if np.linalg.norm(each) < FAR_M])

    def _frame(self, path: str, pose: Transform = IDENTITY) -> Any:
        return self._scene.add_frame(path, show_axes=False, **_at(pose))

    def _line(self, path: str, colour: tuple[int, int, int]) -> Any:
        nothing = np.zeros((1, 2, 3), np.float32)
        return self._scene.add_line_segments(path, nothing, colour, thickness=3.0, thickness_units="screen")

    def _add_mesh(self, path: str, mesh: LinkMesh) -> Any:
        scene, at = self._scene, _at(mesh.pose)
        if mesh.colour is None and mesh.path.suffix.lower() == ".glb":
            return scene.add_glb(path, mesh.path.read_bytes(), scale=mesh.scale, **at)  # with its normals
        try:
            loaded: Any = trimesh.load_mesh(mesh.path)
        except Exception as fault:  # noqa: BLE001 - of any reader of files
            logger.warning("%s is not shown: %s", mesh.path, fault)
            return None
        vertices, colour = loaded.vertices * np.array(mesh.scale), _rgb(mesh.colour or GREY)
        return scene.add_mesh_simple(path, vertices, loaded.faces, color=colour, side="double", **at)

    def _add_shapes(self, path: str, shapes: Iterable[Shape]) -> list[Any]:
        return [self._add_shape(f"{path}/{number}", each) for number, each in enumerate(shapes)]

    def _add_shape(self, path: str, shape: Shape) -> Any:
        scene, (*colour, alpha) = self._scene, shape["colour"]
        look: dict[str, Any] = {"color": _rgb(colour), "opacity": None if alpha == 1.0 else alpha}
        look |= {"cast_shadow": False, **_at(pose_of(shape))}
        match shape["shape"]:
            case "box":
                return scene.add_box(path, dimensions=1e-3 * np.array(shape["size_mm"]), **look)
            case "mesh":
                corners = 1e-3 * np.array(shape["corners_mm"])
                faces = np.arange(len(corners)).reshape(-1, 3)
                return scene.add_mesh_simple(path, corners, faces, side="double", **look)
            case "sphere":
                return scene.add_icosphere(path, radius=1e-3 * shape["radius_mm"], **look)
        radius_m, length_m = 1e-3 * shape["radius_mm"], 1e-3 * shape["length_mm"]
        return scene.add_cylinder(path, radius=radius_m, height=length_m, **look)

    def _add_to_path(self, passed_s: float, point: Vector) -> None:
        """Add a point (m) to the path of the TCP. A jump in time or by the backdoor begins a new one."""
        step_m = dist(point, self._path[-1]) if self._path else 0.0
        if not 0.0 <= passed_s <= TRAIL_JUMP_S or step_m > TRAIL_STEP_M + FASTEST_M_S * passed_s:
            self._path.clear()
        if not self._path or step_m > TRAIL_STEP_M:
            self._path.append(point)
        self._trail.visible = len(self._path) > 1
        if self._trail.visible:
            points = np.array(self._path)
            self._trail.points = np.stack([points[:-1], points[1:]], axis=1)


def _at(pose: Transform) -> dict[str, Any]:
    x, y, z, w = quaternion_from_rotation(pose.rotation)
    return {"position": pose.translation, "wxyz": (w, x, y, z)}


def _place(node: Any, pose: Transform) -> None:
    for name, value in _at(pose).items():
        setattr(node, name, value)


def _rgb(colour: Sequence[float]) -> tuple[int, int, int]:
    red, green, blue = (round(255 * each) for each in colour[:3])
    return red, green, blue
