"""Contacts of links with surfaces: their forces, and the torques on the robot."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.contact.links import Links
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, compose, inverse, transform_from_euler
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model
from tests.contact.materials import at, surface
from tests.stepped import ARMS, ROBOTS

Array = NDArray[np.float64]

TICK_S = 0.001
STIFFNESS = 50_000.0
MODELS = {name: Model(load_robot(name)) for name in ROBOTS}
SHAPES: list[Shape] = [Plane(), Box(0.2, 0.3, 0.1), Sphere(0.25), Cylinder(0.15, 0.3)]
parts = st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7)
angles, metres = st.floats(-3.0, 3.0), st.floats(-1.0, 1.0)
poses = st.builds(transform_from_euler, metres, metres, metres, angles, angles, angles)


class Arm(Links):
    """The links of an arm, tick by tick."""

    def __init__(self, name: str, tool: Sequence[Capsule] = ()) -> None:
        super().__init__(MODELS[name], tool)
        self._tick = 0
        self._was: tuple[float, ...] = ()

    def goes_to(self, joints: tuple[float, ...]) -> None:
        """Go there in the least number of ticks; only the last one is made."""
        speeds = self._model.description.velocity
        turns = zip(joints, self._was or joints, speeds, strict=True)
        self._tick += 1 + int(max(abs(a - b) / speed for a, b, speed in turns) / TICK_S)
        if not self.gaps.is_free(joints, self._tick, TICK_S):
            self.step(joints, self._was or joints, self._tick, TICK_S)
        self._was = joints

    def look_at(self, joints: tuple[float, ...]) -> None:
        """Go there from another place, and rest."""
        self.gaps.forget()
        self.step(joints, joints, self._tick, TICK_S)
        self._was = joints


def links_of(name: str) -> Arm:
    return Arm(name)


def joints_at(name: str, part: list[float]) -> tuple[float, ...]:
    """Return joint positions at parts of their ranges."""
    description = MODELS[name].description
    return tuple(p * high for p, high in zip(part, description.position_max, strict=False))


def ends_of(name: str, capsule: Capsule, joints: tuple[float, ...]) -> tuple[Vector, Vector]:
    """Return the pose of a capsule in the base, by composing poses from joint to joint."""
    model = MODELS[name]

    def frame(turns: tuple[float, ...]) -> Transform:
        found = IDENTITY
        for fixed, turn in zip(model.fixed_poses[: capsule.joints], turns, strict=False):
            found = compose(compose(found, fixed), transform_from_euler(0.0, 0.0, 0.0, turn, 0.0, 0.0))
        return found

    moved = compose(frame(joints), inverse(frame((0.0,) * len(joints))))
    return apply(moved, capsule.start), apply(moved, capsule.end)


def depth_in(placed: Surface, ends: tuple[Vector, Vector], radius: float) -> float:
    """Return the penetration depth (m) of a capsule in a surface, by points along its line."""
    line = np.array(ends[0]) + np.linspace(0.0, 1.0, 400)[:, None] * np.subtract(ends[1], ends[0])
    most = radius + float(np.linalg.norm(line[-1] - line[200])) - placed.nearest(*line[200].tolist())[0]
    if most < -2e-3:  # far away
        return most
    return radius - min(placed.nearest(*point)[0] for point in line.tolist())


def is_apart(name: str, placed: Surface, joints: tuple[float, ...]) -> bool:
    return all(
        depth_in(placed, ends_of(name, capsule, joints), capsule.radius_m) < -1e-3
        for capsule in capsules_of(MODELS[name].description)
    )


def felt_at(name: str, placed: Surface, start: tuple[float, ...], joints: tuple[float, ...]) -> Arm:
    """Return the forces at rest at joint positions, for an arm that came from free space."""
    links = links_of(name)
    links.surround({placed.name: placed}, start)
    links.goes_to(start)
    links.look_at(joints)
    return links


@given(st.sampled_from(ARMS), st.sampled_from(SHAPES), poses, parts, parts)
def test_the_force_on_a_link_is_stiffness_times_its_greatest_depth(
    name: str, shape: Shape, pose: Transform, first: list[float], second: list[float]
) -> None:
    placed = surface(shape, pose, stiffness=STIFFNESS)
    start, joints = joints_at(name, first), joints_at(name, second)
    if not is_apart(name, placed, start):
        return
    links = felt_at(name, placed, start, joints)
    expected: dict[str, float] = {}
    for capsule in capsules_of(MODELS[name].description):
        depth = depth_in(placed, ends_of(name, capsule, joints), capsule.radius_m)
        if capsule.joints > 0 and depth > 1e-6:
            expected[capsule.link] = max(expected.get(capsule.link, 0.0), STIFFNESS * depth)
    forces = {contact.link: float(np.linalg.norm(contact.force)) for contact in links.forces.contacts}
    forces = {link: force for link, force in forces.items() if force > STIFFNESS * 1e-6 or link in expected}
    assert forces == pytest.approx(expected, rel=2e-3, abs=STIFFNESS * 1e-5)  # samples are 0.5 mm apart
    assert any(links.forces.torques or ()) == bool(links.forces.contacts)


@given(st.sampled_from(ARMS), st.sampled_from(SHAPES), poses, parts, parts)
def test_torques_do_the_work_of_the_forces(
    name: str, shape: Shape, pose: Transform, first: list[float], second: list[float]
) -> None:
    """J^T of the point of the link: for any small turn of the joints, torques and forces do the same work."""
    placed = surface(shape, pose, stiffness=STIFFNESS)
    start, joints = joints_at(name, first), joints_at(name, second)
    if not is_apart(name, placed, start):
        return
    links = felt_at(name, placed, start, joints)
    if links.forces.torques is None:
        return
    model, contacts = MODELS[name], links.forces.contacts
    by_name = {capsule.link: capsule.joints for capsule in capsules_of(model.description)}
    expected = np.zeros(len(joints))
    for contact in contacts:
        frame = IDENTITY
        for joint in range(by_name[contact.link]):
            fixed = compose(frame, model.fixed_poses[joint])
            axis = np.array(fixed.rotation).reshape(3, 3)[:, 2]
            lever = np.cross(axis, np.subtract(1e-3 * np.array(contact.point), fixed.translation))
            expected[joint] += float(np.dot(lever, contact.force))
            frame = compose(fixed, transform_from_euler(0.0, 0.0, 0.0, joints[joint], 0.0, 0.0))
    assert links.forces.torques == pytest.approx(expected.tolist(), rel=1e-9, abs=1e-6)


@given(st.sampled_from(ARMS), st.sampled_from(SHAPES), poses, st.integers(0, 10**6))
def test_no_contact_is_missed_between_measurements(
    name: str, shape: Shape, pose: Transform, seed: int
) -> None:
    """An arm that measures only near contacts has the same forces as one that measures in each tick."""
    rng = np.random.default_rng(seed)
    placed = surface(shape, pose, stiffness=STIFFNESS)
    count = len(MODELS[name].description.joints)
    path = [joints_at(name, (rng.uniform(-0.8, 0.8, count)).tolist())]
    if not is_apart(name, placed, path[0]):
        return
    step = rng.normal(size=count) * 10.0 ** rng.uniform(-4, -2)
    path += [tuple((np.array(path[0]) + n * step).tolist()) for n in range(1, 150)]
    thrifty, anew = links_of(name), links_of(name)
    for arm in (thrifty, anew):
        arm.surround({"it": placed}, path[0])
    for joints, ahead in pairwise((*path, path[-1])):
        thrifty.goes_to(joints)
        thrifty.gaps.is_free(ahead, thrifty._tick + 1, TICK_S)
        anew.gaps.forget()
        anew.goes_to(joints)
        assert thrifty.forces.contacts == anew.forces.contacts
        assert thrifty.forces.torques == anew.forces.torques
        assert thrifty.forces.folded == anew.forces.folded


def test_a_surface_around_the_arm_acts_only_after_the_arm_has_left_it() -> None:
    name = ARMS[0]
    home = MODELS[name].description.home
    links = links_of(name)
    floor = surface(Plane(), at(0.0, 0.0, 0.0), name="floor", stiffness=STIFFNESS)
    table = surface(Plane(), at(0.0, 0.0, 0.3), name="table", stiffness=STIFFNESS)
    tilted = (0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # the arm hangs below the height of its shoulder
    for here, feels in (({"table": table}, []), ({"floor": floor}, ["floor"])):
        links.forget()
        links.surround(here, home)
        links.goes_to(home)
        assert links.forces.contacts == ()
        links.goes_to(tilted)
        assert sorted({contact.surface for contact in links.forces.contacts}) == feels
    ball = surface(Sphere(0.1), at(0.0, 0.0, 0.9), name="ball", stiffness=STIFFNESS)
    upright, away = (0.0,) * 7, (0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    links.forget()
    links.surround({"ball": ball}, upright)
    for joints, feels in ((upright, []), (away, []), (upright, ["ball"])):
        links.goes_to(joints)
        assert sorted({contact.surface for contact in links.forces.contacts}) == feels


FOLDED = (0.0, 2.09, 0.0, -2.04, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_an_arm_at_home_and_stretched_does_not_meet_itself(name: str) -> None:
    arm, description = links_of(name), MODELS[name].description
    for joints in (description.home, (0.0,) * len(description.joints)):
        arm.look_at(joints)
        assert arm.forces.folded is None
        assert arm.forces.colliding is None


def test_an_arm_that_folds_onto_its_base_pushes_joints_between_both_links() -> None:
    arm = links_of(ARMS[0])
    arm.look_at(FOLDED)
    assert arm.forces.colliding == ("iiwa_link_0", "iiwa_link_5")
    assert arm.forces.folded is not None
    assert arm.forces.folded[5:] == (0.0, 0.0), "link 5 meets it, so joints beyond are not pushed"


def test_a_tool_that_is_turned_back_meets_the_arm() -> None:
    rod = Capsule("tool", 0, (0.0, 0.0, 0.05), (0.0, 0.0, 0.4), 0.02)
    for tool, names in (((rod,), "tool"), ((), None)):
        arm = Arm(ARMS[0], tool)
        arm.look_at((0.0, 0.6, 0.0, -2.0, 0.0, 1.9, 0.0))
        assert (arm.forces.colliding and arm.forces.colliding[1]) == names
