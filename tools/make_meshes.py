"""Generate low-polygon meshes of the built-in robots, one binary glTF file per link.

Every surface is a loft through closed rings. The curves are our own, drawn from published lengths and from
general proportions of the arms. No file of a manufacturer is read. Lengths come from the joints of a URDF.

Usage:
    python -m tools.make_meshes
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from math import cos, pi, radians
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.exchange.gltf import export_glb
from trimesh.visual.material import PBRMaterial

ROBOTS = Path(__file__).parents[1] / "robots"
Array = NDArray[np.float64]
Lengths = dict[str, float]
"""Distance of each joint from the one before (m), by the joint's name."""
AROUND = 24
"""Vertices of a ring."""
GAP_M = 0.002
"""Half of the gap between two housings."""
CREASE = cos(radians(40.0))
"""Cosine of the angle between two segments of a profile from which on the edge is sharp."""
MATT = {"metallicFactor": 0.0, "roughnessFactor": 0.55}
COLOURS = {
    "shell": (0.86, 0.87, 0.88),
    "orange": (1.00, 0.47, 0.10),
    "dark": (0.31, 0.31, 0.33),
    "metal": (0.66, 0.67, 0.69),
}
"""sRGB of the materials."""

UPRIGHT = np.eye(4)
Z_TO_Y = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
Z_TO_X = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)
HALF_TURN_X = np.diag([1.0, -1.0, -1.0, 1.0])
HALF_TURN_Z = np.diag([-1.0, -1.0, 1.0, 1.0])


class Link:
    """Mesh of one link: surfaces by the name of their colour."""

    def __init__(self) -> None:
        self._surfaces: dict[str, list[trimesh.Trimesh]] = {}

    def loft(self, colour: str, rings: Array, pose: Array = UPRIGHT, cover: bool = False) -> None:
        """Add a smooth surface of a colour through rings, and with `cover` a flat face on the last one.

        Rings are points (ring, vertex, 3; m), counter-clockwise as seen from the last ring.
        """
        count, around = rings.shape[:2]
        row, column = (each.ravel() for each in np.meshgrid(range(count - 1), range(around), indexing="ij"))
        here, beside = row * around + column, row * around + (column + 1) % around
        lower = np.stack([here, beside, beside + around], axis=1)
        upper = np.stack([here, beside + around, here + around], axis=1)
        surface = trimesh.Trimesh(rings.reshape(-1, 3), np.concatenate([lower, upper]), process=False)
        surface.update_faces(surface.nondegenerate_faces())
        surface.apply_transform(pose)
        self._surfaces.setdefault(colour, []).append(surface)
        if cover:
            middle = np.repeat(rings[-1].mean(axis=0)[None], around, axis=0)
            self.loft(colour, np.stack([rings[-1], middle]), pose)

    def revolve(self, colour: str, profile: Sequence[Sequence[float]], pose: Array = UPRIGHT) -> None:
        """Add a surface of revolution about z, with sharp edges where the profile has them.

        The profile has radius and height (m) of each ring, counter-clockwise about the solid.
        """
        rings = np.stack([ellipse((0, 0, z), (r, 0, 0), (0, r, 0)) for r, z in profile])
        steps = np.diff(np.asarray(profile, float), axis=0)
        steps /= np.linalg.norm(steps, axis=1, keepdims=True)
        sharp = [n + 1 for n in range(len(steps) - 1) if steps[n] @ steps[n + 1] < CREASE]
        for first, last in zip([0, *sharp], [*sharp, len(rings) - 1], strict=True):
            self.loft(colour, rings[first : last + 1], pose)

    def save(self, path: Path) -> int:
        """Write a binary glTF file with one primitive per colour, and return its size in bytes."""
        scene = trimesh.Scene()
        for colour, surfaces in self._surfaces.items():
            mesh = trimesh.util.concatenate(surfaces)
            normals = np.full_like(mesh.vertices, 1e-12)
            np.add.at(normals, mesh.faces.ravel(), np.repeat(mesh.triangles_cross, 3, axis=0))
            mesh.vertex_normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
            linear = [((value + 0.055) / 1.055) ** 2.4 for value in COLOURS[colour]]  # glTF stores linear RGB
            material = PBRMaterial(name=colour, baseColorFactor=[*linear, 1.0], **MATT)
            mesh.visual = trimesh.visual.TextureVisuals(material=material)
            scene.add_geometry(mesh, geom_name=colour, node_name=colour)
        return path.write_bytes(export_glb(scene, include_normals=True))


def at(x: float, y: float, z: float, rotation: Array = UPRIGHT) -> Array:
    """Return the pose that first rotates and then translates by x, y, z (m)."""
    return trimesh.transformations.translation_matrix((x, y, z)) @ rotation


def ellipse(centre: Sequence[float], u: Sequence[float], v: Sequence[float], exponent: float = 2.0) -> Array:
    """Return a ring about `centre` with half axes `u` and `v` (m).

    It is an ellipse for exponent 2 and a rounded rectangle for larger exponents (a superellipse).
    """
    turns = np.linspace(0.0, 2.0 * pi, AROUND, endpoint=False)[:, None]
    along_u, along_v = (np.sign(e) * np.abs(e) ** (2.0 / exponent) for e in (np.cos(turns), np.sin(turns)))
    return np.asarray(centre, float) + along_u * np.asarray(u, float) + along_v * np.asarray(v, float)


def curve(corners: Sequence[Sequence[float]] | Array, count: int) -> Array:
    """Return `count` points, evenly spaced, on the quadratic B-spline of a control polygon."""
    points = np.asarray(corners, float)
    for _ in range(4):  # Chaikin's corner cutting, which keeps both ends
        first, second = points[:-1], points[1:]
        cut = np.stack([0.75 * first + 0.25 * second, 0.25 * first + 0.75 * second], axis=1)
        points = np.concatenate([points[:1], cut.reshape(-1, points.shape[1]), points[-1:]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    even = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(even, along, values) for values in points.T], axis=1)


def knee(tube: float, head: float, bulge: float, length: float, count: int = 13) -> Array:
    """Return the rings of a housing that leads from a tube about z to a joint axis along y.

    The tube has a radius at z = 0, the round face of the head another (m). The face is open, at y = -GAP_M.
    The outer side bulges to a distance (m) from the plane y = 0; the joint axis is at z = `length` (m).
    """
    low, high, side = length - head, length + head, -bulge
    rise = [(-tube, GAP_M), (-tube, 0.45 * low), (side, 0.9 * low)]
    outer = curve([*rise, (side, length), (side, high), (-GAP_M, high)], count)
    inner = curve([(tube, GAP_M), (tube, 0.45 * low), (-GAP_M, 0.8 * low), (-GAP_M, low)], count)
    ease = np.clip(np.linspace(-0.2, 1.4, count), 0.0, 1.0)
    widths = tube + (head - tube) * ease**2 * (3.0 - 2.0 * ease)
    powers = 2.0 + 0.4 * np.sin(np.linspace(0.0, pi, count))  # round where housings meet, fuller between
    rows = zip(0.5 * (inner + outer), 0.5 * (inner - outer), widths, powers, strict=True)
    return np.stack([ellipse((0, *middle), (a, 0, 0), (0, *half), power) for middle, half, a, power in rows])


def body(axis: str, rows: str, count: int, domes: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return the rings of a body along x or z, whose ends may be round in the side view.

    Args:
        axis: "x" or "z".
        rows: Corners of the profile, separated by commas. Each has six numbers: position along the axis, the
            middle and the half sizes of the section in y and z, or in x and y (mm), and its exponent.
        count: Number of rings between the ends.
        domes: Lengths of the round ends (m), where the half size in z, or in x, goes to 0; 0 for a flat end.
    """
    profile = curve(np.array([row.split() for row in rows.split(",")], float) * [*5 * [1e-3], 1.0], count)
    turns = np.radians([25.0, 48.0, 68.0, 82.0, 90.0])
    start, end = (np.repeat(profile[n][None], len(turns) if domes[n] else 0, axis=0) for n in (0, -1))
    for dome, length in ((start, -domes[0]), (end, domes[1])):
        if length:
            dome[:, 0] += length * np.sin(turns)
            dome[:, 4 if axis == "x" else 3] *= np.cos(turns)
    sections = np.concatenate([start[::-1], profile, end])
    rings = np.stack([ellipse((u, v, w), (a, 0, 0), (0, b, 0), power) for w, u, v, a, b, power in sections])
    return rings @ Z_TO_X[:3, :3].T if axis == "x" else rings


def add_cap(link: Link, collar: str, radius: float, depth: float, x: float, y: float, z: float) -> None:
    """Add a flat joint cap, dark with an orange rim, that looks away from the plane y = 0.

    A collar of a colour and depth (m) reaches into the housing; x, y, z (m) is the middle of the cap.
    """
    pose = at(x, y, z, Z_TO_Y if y > 0.0 else HALF_TURN_X @ Z_TO_Y)
    link.revolve(collar, [(radius + 0.3 * depth, -depth), (radius + 0.001, -0.003)], pose)
    link.revolve("orange", [(radius + 0.001, -0.003), (radius - 0.006, 0.0)], pose)
    link.revolve("dark", [(radius - 0.006, -0.001), (0.0, 0.0015)], pose)


def add_seam(link: Link, radius: float, pose: Array = UPRIGHT) -> None:
    """Add the dark ring that shows in the gap between two housings."""
    link.revolve("dark", [(radius, -2.0 * GAP_M), (radius, 2.0 * GAP_M)], pose)


def iiwa(lengths: Lengths, scale: float) -> dict[str, Link]:
    """Return the links of an LBR iiwa, with radii relative to those of the LBR iiwa 7."""
    tubes = [scale * r for r in (0.074, 0.070, 0.068, 0.064, 0.061, 0.044)]  # at A1, A3, A3, A5, A5, A7
    heads = [scale * r for r in (0.086, 0.086, 0.078, 0.078, 0.060, 0.060)]  # at A2, A2, A4, A4, A6, A6
    bulges = [scale * r for r in (-0.088, 0.088, 0.080, -0.080, -0.064, 0.064)]  # along y
    links = {f"iiwa_link_{n}": Link() for n in range(8)}
    base, *housings, last = links.values()

    top, foot, collar = lengths["A1"] - GAP_M, scale * 0.108, scale * 0.078
    wall = [(0.93 * foot, 0.024), (0.9 * foot, 0.6 * top), (1.06 * collar, 0.8 * top), (collar, top)]
    base.revolve("dark", [(foot, 0.0), (foot, 0.016), (0.95 * foot, 0.022), (0.9 * foot, 0.024)])
    base.revolve("shell", [*curve(wall, 8), (0.0, top)])
    sockets = body("x", "-50 0 66 58 38 6, -135 0 66 57 37 6, -146 0 66 50 32 6", 4)
    base.loft("dark", sockets[:, ::-1], cover=True)

    for n, (link, tube, head, bulge) in enumerate(zip(housings, tubes, heads, bulges, strict=True)):
        length, has_tube_above = lengths[f"A{n + 2}"], n % 2 == 1
        pose = at(0, 0, length, HALF_TURN_X) if has_tube_above else UPRIGHT
        pose = pose if (bulge > 0.0) == has_tube_above else HALF_TURN_Z @ pose
        link.loft("shell", knee(tube, head, abs(bulge), length), pose)
        add_cap(link, "shell", 0.7 * head, 0.022, 0, 1.035 * bulge, 0.0 if has_tube_above else length)
        if not has_tube_above:
            add_seam(link, 0.993 * tube)
            add_seam(link, 0.993 * head, at(0, 0, length, Z_TO_Y))
    add_seam(last, 0.993 * tubes[5])
    disc = [(0, GAP_M), (0.044, GAP_M), (0.046, 0.006), (0.046, 0.026), (0.042, 0.034), (0, 0.034)]
    last.revolve("dark", disc)
    last.revolve("orange", [(0.0462, 0.014), (0.0468, 0.015), (0.0468, 0.019), (0.0462, 0.02)])
    return links


def kr_6(lengths: Lengths) -> dict[str, Link]:
    """Return the links of a KR 6 R900 sixx."""
    links = {f"kr_6_link_{n}": Link() for n in range(7)}
    base, turret, arm, elbow, forearm, wrist, flange = links.values()
    top, shoulder, reach, a4, a5 = (1e3 * lengths[name] for name in ("A1", "A2", "A3", "A4", "A5"))
    gap = 1e3 * GAP_M

    base.loft("dark", body("z", "0 -10 0 150 135 9, 20 -10 0 150 135 9, 27 -10 0 144 129 9", 4), cover=True)
    rows = f"20 -22 0 124 108 5, 100 -18 0 112 104 4, 130 0 0 104 104 2, {top - gap} 0 0 104 104 2"
    base.loft("dark", body("z", rows, 8))
    base.loft("dark", body("x", "-90 0 66 65 40 6, -178 0 66 60 36 6", 2)[:, ::-1], cover=True)

    add_seam(turret, 0.1035)
    rows = f"{gap} 0 0 104 104 2, 40 0 0 106 106 2.2, 70 10 0 104 100 3.5, 108 18 0 94 95 4, 116 18 0 70 90 4"
    turret.loft("orange", body("z", rows, 9), cover=True)
    for y in (-74.5, 74.5):
        rows = f"30 10 {0.83 * y} 55 20 3, 90 18 {y} 90 21.5 3.5, 130 22 {y} 92 21.5 4"
        rows += f", {shoulder - 20} 25 {y} 84 21.5 4, {shoulder} 25 {y} 84 21.5 4"
        turret.loft("orange", body("z", rows, 7, (0.0, 0.084)))

    rows = "0 0 0 50 82 4, 40 0 0 50 84 4, 140 0 4 46 62 3, 280 0 6 44 50 3, 400 0 0 52 62 4"
    arm.loft("orange", body("x", f"{rows}, {reach} 0 0 52 64 4", 10, (0.082, 0.064)))

    drum = [(0.05, -0.068), (0.062, -0.068), (0.07, -0.06), (0.07, 0.06), (0.062, 0.068), (0.05, 0.068)]
    elbow.revolve("orange", drum, Z_TO_Y)
    rows = f"-70 0 33 60 58 3.5, 20 0 33 62 62 3, 90 0 35 56 56 2.2, {a4 - gap} 0 35 53 53 2"
    elbow.loft("orange", body("x", rows, 9, (0.04, 0.0)))

    add_seam(forearm, 0.0525, Z_TO_X)
    rows = f"{gap} 0 0 53 53 2, 60 0 0 52 52 2, 120 0 0 44 43 2.2, 210 0 0 46 38 4, {a5 - 42} 0 0 46 37 4"
    forearm.loft("orange", body("x", rows, 9), cover=True)
    for y in (-36.5, 36.5):
        forearm.loft("orange", body("x", f"{a5 - 90} {y} 0 9.5 34 4, {a5} {y} 0 9.5 36 4", 3, (0.0, 0.036)))

    for side in (-1, 1):
        add_cap(turret, "orange", 0.066, 0.012, 0.025, 0.099 * side, lengths["A2"])
        add_cap(elbow, "orange", 0.054, 0.012, 0, 0.071 * side, 0)
        add_cap(forearm, "orange", 0.027, 0.006, lengths["A5"], 0.048 * side, 0)

    knuckle = [(0, -0.0255), (0.03, -0.0255), (0.033, -0.022), (0.033, 0.022), (0.03, 0.0255), (0, 0.0255)]
    wrist.revolve("dark", knuckle, Z_TO_Y)
    neck = [(0.026, 0), (0.028, 0.03), (0.034, 0.042), (0.034, 0.056), (0.031, 0.0585), (0, 0.0585)]
    wrist.revolve("dark", neck, Z_TO_X)
    flange.revolve("metal", [(0.025, -0.001), (0.025, 0.018), (0.023, 0.02), (0, 0.02)], Z_TO_X)
    return links


def links_of(urdf: Path) -> dict[str, Link]:
    """Return the links of a built-in robot. Lengths are the largest coordinate of each joint's origin."""
    origins = {joint.get("name", ""): joint.find("origin") for joint in ET.parse(urdf).iter("joint")}
    places = {name: o.get("xyz", "0") for name, o in origins.items() if o is not None}
    lengths = {name: max(map(float, place.split())) for name, place in places.items()}
    scale = 1.075 if lengths["A2"] > 0.2 else 1.0  # the LBR iiwa 14 is thicker
    return iiwa(lengths, scale) if "A7" in lengths else kr_6(lengths)


def main() -> None:
    """Write the meshes of all built-in robots."""
    for urdf in sorted(ROBOTS.glob("*/robot.urdf")):
        folder = urdf.parent / "meshes"
        folder.mkdir(exist_ok=True)
        sizes = [link.save(folder / f"{name}.glb") for name, link in links_of(urdf).items()]
        print(f"{folder}: {sum(sizes) / 1000:.1f} kB")


if __name__ == "__main__":
    main()
