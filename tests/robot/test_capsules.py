"""Capsules of the built-in robots against the shapes of their links, at zero pose."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import built_in_robots, load_robot
from iiwa_sim.robot.model import arm_model

Array = NDArray[np.float64]
OUTSIDE_MM = {"kr_6_r900_sixx": 27.0, "lbr_iiwa_14_r820": 19.0, "lbr_iiwa_7_r800": 17.0}
"""Greatest distance of a corner of a link outside of its capsules."""
OFF_MM = 33.0
"""Greatest distance of a point of a capsule outside of the links."""


def shapes(name: str) -> Array:
    """Triangles (m, 3, 3) of all links, in the base."""
    description, poses, found = load_robot(name), list[Transform](), []
    for link in arm_model(description).links:
        poses.append(link.pose if link.parent is None else compose(poses[link.parent], link.pose))
        path = Path(description.urdf_path).parent / "meshes" / f"{link.name}.glb"
        if path.is_file():
            rotation = np.reshape(poses[-1].rotation, (3, 3))
            found.append(trimesh.load(path).to_geometry().triangles @ rotation.T + poses[-1].translation)
    return np.concatenate(found)


def distances(points: Array, capsule: Capsule) -> Array:
    start, axis = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
    shares = np.clip((points - start) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
    found: Array = np.linalg.norm(points - start - shares[:, None] * axis, axis=1) - capsule.radius_m
    return found


def on_surface(capsule: Capsule, rng: np.random.Generator) -> Array:
    """Points (20, 3) all over a capsule."""
    start, axis = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
    around = start + rng.uniform(-0.5, 1.5, (20, 1)) * axis + rng.normal(size=(20, 3))
    shares = np.clip((around - start) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
    out = around - start - shares[:, None] * axis
    found: Array = around - out + capsule.radius_m * out / np.linalg.norm(out, axis=1, keepdims=True)
    return found


def is_within(point: Array, triangles: Array) -> bool:
    """Return whether a point is in a shape, by the solid angle of its triangles."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return bool(np.arctan2((a * np.cross(b, c)).sum(1), below).sum() > np.pi)


@pytest.mark.parametrize("name", built_in_robots())
def test_capsules_fit_the_shapes_of_the_links(name: str) -> None:
    triangles, capsules, rng = shapes(name), capsules_of(load_robot(name)), np.random.default_rng(0)
    corners = triangles.reshape(-1, 3)
    corners = corners[corners[:, 2] > 0.03]  # the foot stands on something
    outside = np.min([distances(corners, each) for each in capsules], axis=0).max()
    faces = np.arange(triangles.size // 3).reshape(-1, 3)
    samples, _ = trimesh.remesh.subdivide_to_size(triangles.reshape(-1, 3), faces, 0.03)
    points = np.concatenate([on_surface(each, rng) for each in capsules])
    squared = (samples**2).sum(1)
    squares = [(point @ point) + (squared - 2.0 * samples @ point).min() for point in points]
    farthest = sorted(zip(np.sqrt(squares), map(tuple, points), strict=True), reverse=True)
    off = next(near for near, point in farthest if not is_within(np.array(point), triangles))
    assert 1e3 * outside < OUTSIDE_MM[name]
    assert 1e3 * off < OFF_MM
