"""Fit capsules to the meshes of a built-in robot, and print them as `[capsules_mm]` of its robot.toml.

Each link gets few capsules. No point of its mesh is farther out of them than a bound. They reach no farther
out of the link and its neighbours, at two positions of the joints. The search is random.

Usage:
    python -m tools.fit_capsules NAME [BOUND_MM]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose, inverse
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.model import arm_model

Array = NDArray[np.float64]
TURNS_RAD = (0.0, 1.5)
"""Positions of all joints."""
FOOT_MM = 30.0
"""Height up to which the base need not be covered: it stands on something."""
EDGE_MM, SKIN_MM, OWN_MM = 15.0, 7.0, 4.0
"""Longest edge of the faces whose middles stand for a mesh, and the cells that keep one of these points."""
ROUNDING_MM = 1.8
POOL, TRIES, MOST = 1500, 40, 16
SPREADS_MM = (40.0, 20.0, 10.0, 5.0, 2.0) * 4
"""Standard deviations of the random changes of ends, sweep by sweep."""


class Skin:
    """Points (n, 3; mm) on the outside of a link and its neighbours, and their normals."""

    def __init__(self, meshes: list[Array], own: int) -> None:
        """Take triangles (m, 3, 3; mm) of each mesh in the frame of the link, which has the index `own`."""
        fine, is_own = np.zeros((0, 3, 3)), np.zeros(0, bool)
        for n, mesh in enumerate(meshes):
            faces = np.arange(3 * len(mesh)).reshape(-1, 3)
            corners, rows = trimesh.remesh.subdivide_to_size(mesh.reshape(-1, 3), faces, EDGE_MM)
            fine = np.concatenate([fine, corners[rows]])
            is_own = np.append(is_own, np.full(len(rows), n == own))
        middles, normals = fine.mean(axis=1), np.cross(fine[:, 1] - fine[:, 0], fine[:, 2] - fine[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-9)
        outside = ~is_within(middles + 3.0 * normals, np.concatenate(meshes))
        kept = np.flatnonzero(outside)[thinned(middles[outside], SKIN_MM)]
        self.points, self.normals = middles[kept].astype(np.float32), normals[kept]
        self.stands = own == 0  # the base, whose mesh is open below
        self.own = np.concatenate([middles[outside & is_own], fine[outside & is_own].reshape(-1, 3)])
        if self.stands:
            self.own = self.own[self.own[:, 2] > FOOT_MM]

    def depth(self, places: Array) -> Array:
        """Return the distances (mm) of places (..., 3) from the outside, negative beyond it."""
        flat, square = places.reshape(-1, 3).astype(np.float32), (self.points**2).sum(1)
        parts = np.array_split(flat, len(flat) // 500 + 1)
        nearest = np.concatenate([(square - 2.0 * part @ self.points.T).argmin(1) for part in parts])
        gap = self.points[nearest] - flat
        depth: Array = np.copysign(np.linalg.norm(gap, axis=1), (gap * self.normals[nearest]).sum(1))
        depth = np.minimum(depth, flat[:, 2]) if self.stands else depth
        return depth.reshape(places.shape[:-1])


def thinned(points: Array, cell_mm: float) -> NDArray[np.int64]:
    """Return the index of one point in each cell of a grid."""
    return np.unique((points / cell_mm).round(), axis=0, return_index=True)[1]


def is_within(places: Array, triangles: Array) -> NDArray[np.bool_]:
    """Return for each place (n, 3) if it is in meshes, which may be open where another one begins.

    Triangles around a place fill the full solid angle, and half of it at an opening.
    """
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal, volume = np.cross(a, b) + np.cross(b, c) + np.cross(c, a), (a * np.cross(b, c)).sum(1)
    found = []
    for part in np.array_split(places, len(places) // 200 + 1):
        square = (part * part).sum(1)[:, None]
        la, lb, lc = (np.sqrt((square - 2.0 * part @ x.T + (x * x).sum(1)).clip(0.0)) for x in (a, b, c))
        ab, bc, ca = (square - part @ (x + y).T + (x * y).sum(1) for x, y in ((a, b), (b, c), (c, a)))
        below = la * lb * lc + ab * lc + bc * la + ca * lb
        found.append(np.arctan2(volume - part @ normal.T, below).sum(1) > 0.8 * np.pi)
    return np.concatenate(found)


def meshes(description: RobotDescription, turn_rad: float) -> dict[str, tuple[list[Array], int]]:
    """Return triangles (m, 3, 3; mm) of each link and those near it, in its frame, and its own index."""
    arm, folder = arm_model(description), Path(description.urdf_path).parent / "meshes"
    poses: list[Transform] = []
    for link in arm.links:
        pose = link.pose_at([turn_rad] * arm.joint_count)
        poses.append(pose if link.parent is None else compose(poses[link.parent], pose))
    paths = [(folder / f"{link.name}.glb", pose) for link, pose in zip(arm.links, poses, strict=True)]
    shown, found = [(path, pose) for path, pose in paths if path.is_file()], {}
    for n, (own, frame) in enumerate(shown):
        near = list[Array]()
        for path, pose in shown[max(0, n - 2) : n + 2]:
            rotation, place = compose(inverse(frame), pose)
            triangles = 1e3 * trimesh.load(path).to_geometry().triangles
            near.append(triangles @ np.reshape(rotation, (3, 3)).T + 1e3 * np.array(place))
        found[own.stem] = near, min(n, 2)
    return found


def distances(capsules: Array, points: Array) -> Array:
    """Return the distance (mm; capsule, point) of each point from each capsule (n, 7), negative within."""
    start, axis = capsules[:, :3], capsules[:, 3:6] - capsules[:, :3]
    square = (axis * axis).sum(1)[:, None].clip(1e-9)
    along = axis @ points.T - (start * axis).sum(1)[:, None]
    share = np.clip(along / square, 0.0, 1.0)
    from_start = (points**2).sum(1) - 2.0 * start @ points.T + (start**2).sum(1)[:, None]
    return np.sqrt((from_start - share * (2.0 * along - share * square)).clip(0.0)) - capsules[:, 6:]


def widest(ends: Array, looks: list[Skin], bound: float) -> Array:
    """Return capsules (n, 7) about lines (n, 6), as thick as the bound allows."""
    lines = ends[:, None, :3] + np.linspace(0.0, 1.0, 9)[:, None] * (ends[:, 3:] - ends[:, :3])[:, None]
    depth = np.min([look.depth(lines).min(axis=1) for look in looks], axis=0)
    return np.column_stack([ends, depth + bound])[depth > 0.0]


def losses(beyond: Array, found: Array) -> Array:
    """Return for each candidate how badly it and the capsules found cover the points."""
    rest = found.min(axis=0, initial=np.inf)
    near = rest > 0.0
    return (np.minimum(beyond[:, near], rest[near]).clip(0.0) ** 2).sum(axis=1)


def fit(looks: list[Skin], bound: float, rng: np.random.Generator) -> Array:
    """Return capsules (n, 7; mm) of a link: one more, and each in turn moved, until they cover it."""
    points = np.concatenate([look.own for look in looks])
    points = points[thinned(points, OWN_MM)]
    places = rng.uniform(points.min(axis=0), points.max(axis=0), (2 * POOL, 3))
    places = places[np.min([look.depth(places) for look in looks], axis=0) > 0.0]
    pool = widest(rng.choice(places, (POOL, 2)).reshape(-1, 6), looks, bound)
    beyond = distances(pool, points) - bound
    chosen, found = np.zeros((0, 7)), np.zeros((0, len(points)))
    while len(chosen) < MOST and found.min(axis=0, initial=np.inf).max() > 0.0:
        best = losses(beyond, found).argmin()
        chosen, found = np.vstack([chosen, pool[best]]), np.vstack([found, beyond[best]])
        for spread in SPREADS_MM:
            for n in range(len(chosen)):
                change = rng.normal(scale=spread, size=(TRIES, 6)) * rng.integers(2, size=(TRIES, 6))
                moved = np.vstack([chosen[n : n + 1], widest(chosen[n, :6] + change, looks, bound)])
                far = distances(moved, points) - bound
                if spread == SPREADS_MM[0]:
                    moved, far = np.vstack([moved, pool]), np.vstack([far, beyond])
                best = losses(far, np.delete(found, n, axis=0)).argmin()
                chosen[n], found[n] = moved[best], far[best]
    return chosen


def main(name: str, bound_mm: str = "10") -> None:
    """Print the table of a robot."""
    print("[capsules_mm]")
    turned = [meshes(load_robot(name), turn) for turn in TURNS_RAD]
    for link in turned[0]:
        looks = [Skin(*each[link]) for each in turned]
        found = fit(looks, float(bound_mm) - ROUNDING_MM, np.random.default_rng(0))
        print(
            f"{link} = [",
            *(f"  {[round(value) for value in each]}," for each in found.tolist()),
            "]",
            sep="\n",
            flush=True,
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
