"""Piles of parts: compiled as interpreted, and as said by what each part lies on."""

from __future__ import annotations

from math import isclose
from typing import Any

import numpy as np
import pytest

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import IDENTITY, Transform, transform_from_euler
from iiwa_sim.handling import piles_kernel
from iiwa_sim.handling.falling import FALLS, LIES, STILL, Body
from iiwa_sim.handling.part import Part
from tests.handling.scenes import at
from tests.interpreted import interpreted

PLAIN = interpreted("iiwa_sim.handling.piles_kernel")


def bodies_of(rng: np.random.Generator) -> dict[str, Body]:
    """Parts that lie on each other in any order, and some that do not lie, on which others may."""
    order = rng.permutation(20).tolist()
    bodies = {}
    for place, number in enumerate(order):
        on = f"part {order[rng.integers(place)]}" if place and rng.random() < 0.8 else "table"
        part = Part(f"part {number}", Box(0.02, 0.01, 0.03), float(rng.uniform(0.1, 1.0)), 0.5, 5e4)
        pose = at(*rng.uniform(-100.0, 100.0, 3).tolist(), float(rng.uniform(-3.0, 3.0)))
        bodies[part.name] = Body(part, pose, STILL, LIES if rng.random() < 0.9 else FALLS, on)
    return {f"part {number}": bodies[f"part {number}"] for number in range(20)}


def above(bodies: dict[str, Body], name: str) -> list[str]:
    """What lies on a part, and on that, in the order of the cell, each before what lies on it."""
    found = []
    for other, body in bodies.items():
        if body.state == LIES and body.on == name:
            found += [other, *above(bodies, other)]
    return found


def inertia(body: Body, about: Body) -> float:
    """Of a box that stands (kg m^2), about the vertical through the middle of another part."""
    length, width, _ = body.part.shape
    (x, y, _), (u, v, _) = body.pose.translation, about.pose.translation
    return body.part.mass_kg * ((length**2 + width**2) / 3.0 + (x - u) ** 2 + (y - v) ** 2)


@pytest.mark.parametrize("seed", range(10))
def test_what_lies_on_a_part_and_on_that_is_found_and_weighed(seed: int) -> None:
    bodies = bodies_of(np.random.default_rng(seed))
    lying = [name for name, each in bodies.items() if each.state == LIES]
    both: list[Any] = [piles_kernel.Piles(bodies), PLAIN.Piles(bodies)]
    for piles in both:
        piles.look(bodies, lying)
        for number, each in enumerate(bodies.values()):
            piles.weigh(number, each)
    compiled, plain = both
    for number, name in enumerate(bodies):
        names = above(bodies, name)
        assert compiled.above(number) == plain.above(number) == names
        mass, about = compiled.carried(number)
        assert (mass, about) == plain.carried(number)
        assert isclose(mass, sum(bodies[each].part.mass_kg for each in names), abs_tol=1e-12)
        assert isclose(about, sum(inertia(bodies[each], bodies[name]) for each in names), abs_tol=1e-12)
    some = [3, 7, 7, 12]
    assert compiled.all_above(some) == plain.all_above(some)
    assert compiled.all_above(some) == {each for number in some for each in above(bodies, f"part {number}")}


def test_parts_that_come_to_lie_on_others_are_noticed() -> None:
    bodies = bodies_of(np.random.default_rng(0))
    piles = piles_kernel.Piles(bodies)
    piles.look(bodies, list(bodies))
    alone = {name: each._replace(on="table") for name, each in bodies.items()}
    piles.change()
    piles.look(alone, list(alone))
    assert not any(piles.above(number) for number in range(len(alone)))


@pytest.mark.parametrize("shape", [Box(0.02, 0.01, 0.03), Cylinder(0.02, 0.05), Sphere(0.03)])
def test_inertia_about_the_vertical_is_that_of_the_moments(shape: Box | Cylinder | Sphere) -> None:
    rng = np.random.default_rng(4)
    lower, upper = Part("lower", shape, 0.3, 0.5, 5e4), Part("upper", shape, 0.7, 0.5, 5e4)
    for _ in range(100):
        turned = transform_from_euler(0.0, 0.0, 0.0, *rng.uniform(-3.0, 3.0, 3).tolist()).rotation
        pose = Transform(turned, IDENTITY.translation)
        moments = upper.moments(pose)
        bodies = {
            "lower": Body(lower, IDENTITY, STILL, LIES, "table"),
            "upper": Body(upper, pose, STILL, LIES, "lower"),
        }
        piles = piles_kernel.Piles(bodies)
        piles.look(bodies, list(bodies))
        for number, each in enumerate(bodies.values()):
            piles.weigh(number, each)
        mass, about = piles.carried(0)
        assert mass == 0.7
        assert isclose(about, moments.xx + moments.yy, rel_tol=1e-12)
