"""An arm in the scene: a mesh for each link, which the joints turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb

from iiwa_sim.robot.model import Link, Shape
from iiwa_sim.view.drawing import Colour, Drawing, wxyz
from iiwa_sim.view.meshes import joined

if TYPE_CHECKING:
    import viser

GHOST: Colour = (70, 130, 230)
GHOST_OPACITY = 0.25
ROUGHNESS = 0.6


class Arm:
    """The links below a node of the scene; in all, a viewer is sent the turns of the joints that change."""

    def __init__(self, scene: viser.SceneApi, drawing: Drawing, root: str, ghost: bool = False) -> None:
        """A `ghost` is seen through."""
        self.links: dict[str, Any] = {}
        """The handle of each link that has shapes, by its name."""
        self.paths: list[str] = []
        """The node of each link of the drawing."""
        self._drawing = drawing
        self._turned: list[tuple[Link, Any]] = []
        for link, shapes in zip(drawing.links, drawing.shapes, strict=True):
            parent = root if link.parent is None else self.paths[link.parent]
            path = f"{parent}/{link.name.replace('/', '_')}"
            self.paths.append(path)
            handle = _added(scene, link, shapes, path, ghost)
            if shapes:
                self.links[link.name] = handle
            if link.joint is not None:
                self._turned.append((link, handle))

    def show(self, joints: Sequence[float]) -> None:
        """Draw it at these joint positions (rad)."""
        for link, handle in self._turned:
            handle.wxyz = wxyz(link.pose_at(joints).rotation)


def _added(scene: viser.SceneApi, link: Link, shapes: Sequence[Shape], path: str, ghost: bool) -> Any:
    placed: dict[str, Any] = {"position": link.pose.translation, "wxyz": wxyz(link.pose.rotation)}
    if not shapes:
        return scene.add_frame(path, show_axes=False, **placed)
    points, normals, faces, colours = joined(shapes)
    if ghost:
        return scene.add_mesh_simple(
            path,
            points.astype(np.float32),
            faces.astype(np.uint32),
            color=GHOST,
            opacity=GHOST_OPACITY,
            cast_shadow=False,
            receive_shadow=False,
            **placed,
        )
    mesh = trimesh.Trimesh(points, faces, vertex_normals=normals, process=False)
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=colours)
    whole = trimesh.Scene(mesh)
    data = export_glb(whole, include_normals=True, tree_postprocessor=_matt)  # type: ignore[no-untyped-call]
    return scene.add_glb(path, data, **placed)


def _matt(tree: dict[str, Any]) -> None:
    """What is said to be of no material is metal, which is black where there is nothing to mirror."""
    tree["materials"] = [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": ROUGHNESS}}]
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["material"] = 0
