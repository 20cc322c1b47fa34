"""Triangles of simple shapes, with normals, so that edges look sharp and what is round looks round."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.robot.model import Shape

Points = NDArray[np.float64]
Faces = NDArray[np.int64]

AROUND = 28
"""Edges of what is round."""
RINGS = 14
"""Rings of a sphere, from pole to pole."""


def mesh_of(shape: Shape) -> tuple[Points, Points, Faces]:
    """Points (n, 3; m) and normals (n, 3) of a shape in the frame of its link, and triangles (m, 3)."""
    if shape.kind == "box":
        points, normals, faces = box(shape.size_m)
    elif shape.kind == "sphere":
        points, normals, faces = sphere(shape.size_m[0])
    else:
        points, normals, faces = cylinder(shape.size_m[0], shape.size_m[1])
    rotation = np.array(shape.pose.rotation).reshape(3, 3)
    return points @ rotation.T + shape.pose.translation, normals @ rotation.T, faces


def joined(shapes: Sequence[Shape]) -> tuple[Points, Points, Faces, NDArray[np.uint8]]:
    """All shapes of a link as one mesh: points, normals, triangles, and colours (n, 4) of the points."""
    points: list[Points] = []
    normals: list[Points] = []
    faces: list[Faces] = []
    colours: list[NDArray[np.uint8]] = []
    count = 0
    for shape in shapes:
        own_points, own_normals, own_faces = mesh_of(shape)
        points.append(own_points)
        normals.append(own_normals)
        faces.append(own_faces + count)
        colours.append(
            np.tile(np.round(255.0 * np.array(shape.colour)).astype(np.uint8), (len(own_points), 1))
        )
        count += len(own_points)
    return np.concatenate(points), np.concatenate(normals), np.concatenate(faces), np.concatenate(colours)


def box(edges_m: Sequence[float]) -> tuple[Points, Points, Faces]:
    """Round the origin."""
    points: list[Points] = []
    normals: list[Points] = []
    faces: list[tuple[int, int, int]] = []
    half = 0.5 * np.array(edges_m[:3])
    for axis in range(3):
        for side in (1.0, -1.0):
            normal = np.zeros(3)
            normal[axis] = side
            first, second = np.roll(np.eye(3), -axis, axis=0)[[1, 2]]
            count = len(points)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                points.append((normal + side * a * first + b * second) * half)
                normals.append(normal)
            faces += [(count, count + 1, count + 2), (count, count + 2, count + 3)]
    return np.array(points), np.array(normals), np.array(faces)


def cylinder(radius_m: float, length_m: float) -> tuple[Points, Points, Faces]:
    """Round the origin, along z."""
    angles = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(AROUND)], axis=1)
    end = np.array([0.0, 0.0, 0.5 * length_m])
    here = np.arange(AROUND)
    following = np.roll(here, -1)
    points = [radius_m * ring - end, radius_m * ring + end]
    normals = [ring, ring]
    faces = [
        np.stack([here, following, following + AROUND], axis=1),
        np.stack([here, following + AROUND, here + AROUND], axis=1),
    ]
    for side in (-1.0, 1.0):
        count = sum(map(len, points))
        points += [radius_m * ring + side * end, side * end[None]]
        normals += [np.tile([0.0, 0.0, side], (AROUND + 1, 1))]
        edge = [here, following] if side > 0.0 else [following, here]
        faces.append(np.stack([*edge, np.full(AROUND, AROUND)], axis=1) + count)
    return np.concatenate(points), np.concatenate(normals), np.concatenate(faces)


def sphere(radius_m: float) -> tuple[Points, Points, Faces]:
    """Round the origin."""
    turns, heights = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, AROUND + 1), np.linspace(0.0, np.pi, RINGS + 1)
    )
    normals = np.stack(
        [np.sin(heights) * np.cos(turns), np.sin(heights) * np.sin(turns), np.cos(heights)], axis=2
    ).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(RINGS), np.arange(AROUND), indexing="ij")
    corner = (row * (AROUND + 1) + column).ravel()
    below = corner + AROUND + 1
    faces = np.concatenate(
        [np.stack([corner, below, below + 1], axis=1), np.stack([corner, below + 1, corner + 1], axis=1)]
    )
    return radius_m * normals, normals, faces
