"""Pairs of links that MoveIt does not compare, beside distances that Coal finds in other samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pinocchio as pin
import pytest

from iiwa_sim.moveit.pairs import ADJACENT, ALWAYS, NEVER, Pair, disabled_pairs
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.fault import RobotFault
from tests.samples import some
from tests.stepped import ALL_ROBOTS, ARMS

SAMPLES = some(1000)
SPHERE = '<collision><geometry><sphere radius="{}"/></geometry></collision>'


@cache
def pairs_of(name: str) -> tuple[Pair, ...]:
    return tuple(disabled_pairs(load_robot(name), 2000))


@pytest.mark.parametrize("name", ALL_ROBOTS)
def test_links_that_are_not_compared_are_apart_in_other_samples(name: str) -> None:
    robot = load_robot(name)
    model = pin.buildModelFromXML(robot.urdf)
    shapes = pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION)
    never = {frozenset(pair[:2]) for pair in pairs_of(name) if pair.reason == NEVER}
    assert never
    links = [model.frames[each.parentFrame].name for each in shapes.geometryObjects]
    for first, second in combinations(range(len(links)), 2):
        if frozenset((links[first], links[second])) in never:
            shapes.addCollisionPair(pin.CollisionPair(first, second))
    data, asked = model.createData(), pin.GeometryData(shapes)
    random = np.random.default_rng(1)
    for _ in range(SAMPLES):
        pin.computeDistances(
            model, data, shapes, asked, random.uniform(robot.position_min, robot.position_max)
        )
        assert min(each.min_distance for each in asked.distanceResults) > 0.0


@pytest.mark.parametrize("name", ARMS)
def test_neighbours_are_not_compared_and_the_rest_has_a_reason(name: str) -> None:
    found = pairs_of(name)
    robot = load_robot(name)
    adjacent = [pair for pair in found if pair.reason == ADJACENT]
    assert len(adjacent) >= len(robot.joints)
    assert {pair.reason for pair in found} <= {ADJACENT, NEVER}
    assert len({frozenset(pair[:2]) for pair in found}) == len(found)


def test_links_that_can_meet_are_compared() -> None:
    """The flange reaches the base."""
    ends = {frozenset(("iiwa_link_0", "iiwa_link_7")), frozenset(("iiwa_link_0", "iiwa_link_6"))}
    assert not ends & {frozenset(pair[:2]) for pair in pairs_of(ARMS[0])}


def test_links_that_always_touch_are_not_compared() -> None:
    robot = load_robot(ARMS[0])
    swollen = robot.urdf
    for link in ("iiwa_link_0", "iiwa_link_2"):
        swollen = swollen.replace(f'<link name="{link}">', f'<link name="{link}">{SPHERE.format(0.5)}')
    found = disabled_pairs(replace(robot, urdf=swollen), 20)
    assert Pair("iiwa_link_0", "iiwa_link_2", ALWAYS) in found


def test_the_same_samples_are_drawn_each_time() -> None:
    few, again = (disabled_pairs(load_robot(ARMS[1]), 50) for _ in range(2))
    assert few == again


def test_a_mesh_that_is_not_there_is_told() -> None:
    robot = load_robot(ARMS[0])
    mesh = '<collision><geometry><mesh filename="package://nowhere/arm.stl"/></geometry></collision></link>'
    with pytest.raises(RobotFault, match=r"collision"):
        disabled_pairs(replace(robot, urdf=robot.urdf.replace("</link>", mesh, 1)))


@pytest.mark.parametrize(
    ("urdf", "expected"),
    [("nonsense", r"valid XML \(.*\)"), ("<a/>", r"a URDF that Pinocchio can read \(.*\)")],
)
def test_a_urdf_that_cannot_be_read_is_told_in_one_line(
    urdf: str, expected: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """And nothing by the library that reads it."""
    with pytest.raises(RobotFault, match=rf"robot\.urdf: expected {expected}$") as fault:
        disabled_pairs(replace(load_robot(ARMS[0]), urdf=urdf))
    assert "\n" not in str(fault.value)
    assert capfd.readouterr() == ("", "")
