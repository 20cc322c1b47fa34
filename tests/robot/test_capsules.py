"""Capsules of the built-in robots against the meshes of their links."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pytest
from numpy.typing import NDArray

from iiwa_sim.robot.description import load_robot
from tests.samples import MANY
from tests.stepped import ALL_ROBOTS
from tools.fit_capsules import FOOT_MM, TURNS_RAD, distances, is_within, meshes

BOUND_MM = {"kr_6_r900_sixx": 13.0, "lbr_iiwa_7_r800": 10.0, "lbr_iiwa_14_r820": 10.0}
"""The sharp edges of the KR 6 would need twice as many capsules for 10 mm."""


def on_surface(capsule: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return points (12, 3) all over a capsule: x y z of one end, of the other, radius."""
    start, end, radius = capsule[:3], capsule[3:6], capsule[6]
    points = start + rng.uniform(-0.5, 1.5, (12, 1)) * (end - start) + rng.normal(size=(12, 3))
    axis = end - start
    shares = np.clip((points - start) @ axis / max(axis @ axis, 1e-9), 0.0, 1.0)
    middles = start + shares[:, None] * axis
    out = points - middles
    found: NDArray[np.float64] = middles + radius * out / np.linalg.norm(out, axis=1, keepdims=True)
    return found


def below(mesh: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return triangles that close a mesh that is open at a height of 0."""
    edges = mesh[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)
    edges = edges[(np.abs(edges[:, :, 2]) < 1e-6).all(axis=1)]
    return np.stack([edges[:, 1], edges[:, 0], np.zeros((len(edges), 3))], axis=1)


@pytest.mark.parametrize("name", ALL_ROBOTS)
def test_capsules_and_shapes_of_links_bound_each_other(name: str) -> None:
    description, bound, rng = load_robot(name), BOUND_MM[name], np.random.default_rng(0)
    for turn in TURNS_RAD if MANY else TURNS_RAD[1:]:
        for link, (near, own) in meshes(description, turn).items():
            capsules = np.array([each for of, each in description.capsules_mm if of == link])
            corners = np.unique(near[own].reshape(-1, 3), axis=0)
            corners = corners[corners[:, 2] > FOOT_MM] if own == 0 else corners
            corners = corners[distances(capsules, corners).min(axis=0) > bound]
            assert is_within(corners, np.concatenate([*near[:own], *near[own + 1 :]])).all(), link
            triangles, skin = np.concatenate([*near, below(near[0])]), coal.BVHModelOBBRSS()
            skin.beginModel(len(triangles), 3 * len(triangles))
            for a, b, c in triangles:
                skin.addTriangle(a, b, c)
            skin.endModel()
            points = np.concatenate([on_surface(each, rng) for each in capsules])
            off = points[[_distance(skin, point) > bound for point in points]]
            assert is_within(off, triangles).all(), link


def _distance(skin: Any, point: NDArray[np.float64]) -> float:
    request, result, place = coal.DistanceRequest(), coal.DistanceResult(), coal.Transform3s()
    place.setTranslation(point)
    return float(coal.distance(coal.Sphere(1e-3), place, skin, coal.Transform3s(), request, result))
