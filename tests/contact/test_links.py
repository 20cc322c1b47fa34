"""The links of an arm among surfaces: what they feel, when, and what that does to the robot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.contact.link_forces_kernel import LinkContact
from iiwa_sim.contact.links_kernel import Links
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.worn import Worn
from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, compose, inverse, transform_from_euler
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model
from tests.contact.materials import at, surface
from tests.interpreted import interpreted
from tests.stepped import ARMS, ROBOTS

Array = NDArray[np.float64]

TICK_S = 0.001
STIFFNESS = 50_000.0
MODELS = {name: Model(load_robot(name)) for name in ROBOTS}
SHAPES: list[Shape] = [Plane(), Box(0.2, 0.3, 0.1), Sphere(0.25), Cylinder(0.15, 0.3)]
parts = st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7)
angles, metres = st.floats(-3.0, 3.0), st.floats(-1.0, 1.0)
poses = st.builds(transform_from_euler, metres, metres, metres, angles, angles, angles)


def links_of(name: str) -> Links:
    model = MODELS[name]
    return Links(model.tcp_of_flange.fixed, capsules_of(model.description))


def joints_at(name: str, part: list[float]) -> tuple[float, ...]:
    """Joint positions at parts of their ranges."""
    description = MODELS[name].description
    return tuple(p * high for p, high in zip(part, description.position_max, strict=False))


def ends_of(name: str, capsule: Capsule, joints: tuple[float, ...]) -> tuple[Vector, Vector]:
    """Of a capsule in the base, by composing poses from joint to joint."""
    model = MODELS[name]

    def frame(turns: tuple[float, ...]) -> Transform:
        found = IDENTITY
        for fixed, turn in zip(model.fixed_poses[: capsule.joints], turns, strict=False):
            found = compose(compose(found, fixed), transform_from_euler(0.0, 0.0, 0.0, turn, 0.0, 0.0))
        return found

    moved = compose(frame(joints), inverse(frame((0.0,) * len(joints))))
    return apply(moved, capsule.start), apply(moved, capsule.end)


def depth_in(placed: Surface, ends: tuple[Vector, Vector], radius: float) -> float:
    """How deep (m) a capsule is in a surface, by points all along its line."""
    line = np.array(ends[0]) + np.linspace(0.0, 1.0, 400)[:, None] * np.subtract(ends[1], ends[0])
    return radius - min(placed.nearest(*point)[0] for point in line.tolist())


def is_apart(name: str, placed: Surface, joints: tuple[float, ...]) -> bool:
    return all(
        depth_in(placed, ends_of(name, capsule, joints), capsule.radius_m) < -1e-3
        for capsule in capsules_of(MODELS[name].description)
    )


def felt_at(name: str, placed: Surface, start: tuple[float, ...], joints: tuple[float, ...]) -> Links:
    """What is felt at rest at joint positions, by an arm that came from where it touched nothing."""
    links = links_of(name)
    links.surround({placed.name: placed}, start)
    links.step(start, TICK_S)
    links.step(joints, TICK_S)
    links.step(joints, TICK_S)
    return links


@pytest.mark.parametrize("name", ROBOTS)
def test_the_capsules_are_those_of_the_links_base_first(name: str) -> None:
    capsules = capsules_of(MODELS[name].description)
    moved_by = [capsule.joints for capsule in capsules]
    assert moved_by == sorted(moved_by)
    assert set(moved_by) == set(range(len(MODELS[name].description.joints) + 1))
    for capsule in capsules:
        assert 0.005 < capsule.radius_m < 0.11
        assert np.linalg.norm(np.subtract(capsule.start, capsule.end)) < 0.4
    assert np.linalg.norm(capsules[-1].end) == pytest.approx(
        np.linalg.norm(MODELS[name].flange([0.0] * len(MODELS[name].description.joints)).translation),
        abs=0.05,
    )


@given(st.sampled_from(ARMS), st.sampled_from(SHAPES), poses, parts, parts)
def test_a_link_feels_stiffness_times_its_greatest_depth(
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
    forces = {contact.link: float(np.linalg.norm(contact.force)) for contact in links.contacts}
    forces = {link: force for link, force in forces.items() if force > STIFFNESS * 1e-6 or link in expected}
    assert forces == pytest.approx(expected, rel=1e-3, abs=STIFFNESS * 1e-5)
    assert (links.torques is None) == (not links.contacts)


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
    if links.torques is None:
        return
    model, contacts = MODELS[name], links.contacts
    by_name = {capsule.link: capsule.joints for capsule in capsules_of(model.description)}
    expected = np.zeros(len(joints))
    for contact in contacts:
        frame = IDENTITY
        for joint in range(by_name[contact.link]):
            fixed = compose(frame, model.fixed_poses[joint])
            axis = np.array(fixed.rotation).reshape(3, 3)[:, 2]
            lever = np.cross(axis, np.subtract(contact.point, fixed.translation))
            expected[joint] += float(np.dot(lever, contact.force))
            frame = compose(fixed, transform_from_euler(0.0, 0.0, 0.0, joints[joint], 0.0, 0.0))
    assert links.torques == pytest.approx(expected.tolist(), rel=1e-9, abs=1e-6)


@given(st.sampled_from(ARMS), st.sampled_from(SHAPES), poses, st.integers(0, 10**6))
def test_nothing_is_missed_while_nothing_is_looked_at(
    name: str, shape: Shape, pose: Transform, seed: int
) -> None:
    """Along a way, an arm that looks when it could touch feels what one feels that looks in each tick."""
    rng = np.random.default_rng(seed)
    placed = surface(shape, pose, stiffness=STIFFNESS)
    count = len(MODELS[name].description.joints)
    way = [joints_at(name, (rng.uniform(-0.8, 0.8, count)).tolist())]
    if not is_apart(name, placed, way[0]):
        return
    step = rng.normal(size=count) * 10.0 ** rng.uniform(-4, -2)
    way += [tuple((np.array(way[0]) + n * step).tolist()) for n in range(1, 150)]
    thrifty, anew = links_of(name), links_of(name)
    thrifty.surround({"it": placed}, way[0])
    for joints in way:
        thrifty.step(joints, TICK_S)
        anew.surround({"it": placed}, joints)
        anew.step(joints, TICK_S)
        assert thrifty.contacts == anew.contacts
        assert thrifty.torques == anew.torques


def test_what_the_arm_stands_in_is_felt_only_after_all_of_it_has_been_out() -> None:
    name = ARMS[0]
    home = MODELS[name].description.home
    links = links_of(name)
    floor = surface(Plane(), at(0.0, 0.0, 0.0), name="floor", stiffness=STIFFNESS)
    table = surface(Plane(), at(0.0, 0.0, 0.3), name="table", stiffness=STIFFNESS)
    tilted = (0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # the arm hangs below the height of its shoulder
    for here, feels in (({"table": table}, []), ({"floor": floor}, ["floor"])):
        links.forget()
        links.surround(here, home)
        links.step(home, TICK_S)
        assert links.contacts == ()
        links.step(tilted, TICK_S)
        assert sorted({contact.surface for contact in links.contacts}) == feels
    ball = surface(Sphere(0.1), at(0.0, 0.0, 0.9), name="ball", stiffness=STIFFNESS)
    upright, away = (0.0,) * 7, (0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    links.forget()
    links.surround({"ball": ball}, upright)
    for joints, feels in ((upright, []), (away, []), (upright, ["ball"])):
        links.step(joints, TICK_S)
        assert sorted({contact.surface for contact in links.contacts}) == feels


def test_a_surface_that_is_moved_is_still_felt_and_one_that_comes_is_not() -> None:
    name, upright = ARMS[0], (0.0,) * 7
    links = links_of(name)
    away = (0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    ball = surface(Sphere(0.1), at(0.0, 0.0, 0.9), name="ball", stiffness=STIFFNESS)
    links.surround({"ball": ball}, away)
    links.step(away, TICK_S)
    links.step(upright, TICK_S)
    assert links.contacts
    moved, new = ball._replace(pose=at(0.02, 0.0, 0.9)), ball._replace(name="new")
    links.surround({"new": new, "ball": moved}, upright)
    links.step(upright, TICK_S)
    assert {contact.surface for contact in links.contacts} == {"ball"}


def test_damping_counts_the_speed_of_the_link() -> None:
    name = ARMS[0]
    wall = surface(Plane(), transform_from_euler(0.0, 0.3, 0.0, 0.0, 0.0, np.pi / 2), stiffness=STIFFNESS)
    damped = wall._replace(damping=0.5)
    home = MODELS[name].description.home

    def force(placed: Surface, joint_step: float) -> LinkContact:
        links = links_of(name)
        links.surround({placed.name: placed}, home)
        for n in range(10_000):
            links.step((n * joint_step, *home[1:]), TICK_S)
            if links.contacts:
                contact: LinkContact = links.contacts[0]
                return contact
        raise AssertionError("nothing is touched")

    still, fast = force(wall, 1e-3), force(damped, 1e-3)
    x, y, _ = fast.point
    speed = 1e-3 / TICK_S * x  # about the axis of A1, against the wall
    assert still.force[1] < 0.0
    assert fast.force[1] / still.force[1] == pytest.approx(1.0 + 0.5 * speed, rel=1e-6)
    assert y == pytest.approx(0.3, abs=0.01)


def test_compiled_and_interpreted_feel_the_same_bits() -> None:
    plain = interpreted("iiwa_sim.contact.links_kernel")
    rng, touched = np.random.default_rng(5), 0
    for name in ARMS:
        model = MODELS[name]
        arms = [
            kind(model.tcp_of_flange.fixed, capsules_of(model.description)) for kind in (Links, plain.Links)
        ]
        placed = {
            str(number): surface(
                shape,
                at(*rng.uniform(0.2, 0.6, 3).tolist()),
                name=str(number),
                damping=0.5,
                stiffness=STIFFNESS,
            )
            for number, shape in enumerate(SHAPES[1:])
        }
        for arm in arms:
            arm.surround(placed, model.description.home)
        for _ in range(20):
            joints = joints_at(name, rng.uniform(-0.9, 0.9, 7).tolist())
            for arm in arms:
                arm.step(joints, TICK_S)
            touched += arms[0].torques is not None
            assert arms[0].torques == arms[1].torques
            assert arms[0].yielding_to == arms[1].yielding_to
            assert [tuple(each) for each in arms[0].contacts] == [tuple(each) for each in arms[1].contacts]
    assert touched > 3


@pytest.mark.parametrize("name", ARMS)
def test_what_is_looked_at_when_it_is_due_has_the_bits_of_looking_at_all_in_each_tick(name: str) -> None:
    """Along random ways among surfaces, with jaws that open and close meanwhile."""
    rng, model, touched = np.random.default_rng(7), MODELS[name], 0
    rows = zip(SHAPES, rng.uniform(-0.6, 0.6, (4, 3)).tolist(), strict=True)
    placed = {
        str(n): surface(shape, at(x, y, -1.0 if n == 0 else 0.3 + abs(z)), name=str(n), friction=0.4)
        for n, (shape, (x, y, z)) in enumerate(rows)
    }

    def jaws(half: float) -> list[Worn]:
        ends = [((0.0, side * half, 0.02), (0.0, side * half, 0.1)) for side in (-1.0, 1.0)]
        return [Worn(Capsule("jaw", 0, *each, 0.01)) for each in ends]

    due, each_tick = links_of(name), links_of(name)
    for arm in (due, each_tick):
        arm.wear(jaws(0.03))
        arm.surround(placed, model.description.home)
    joints = np.array(model.description.home)
    for _ in range(12):
        target = np.array(joints_at(name, rng.uniform(-0.7, 0.7, 7).tolist()))
        for share in np.linspace(0.02, 1.0, 50):
            there = tuple((joints + share * (target - joints)).tolist())
            each_tick.surround(placed, there)
            for arm in (due, each_tick):
                arm.rewear(jaws(0.03 + 0.02 * float(np.sin(20.0 * share))))
                arm.step(there, TICK_S)
            touched += bool(due.contacts)
            assert (due.torques, due.worn, due.contacts) == (
                each_tick.torques,
                each_tick.worn,
                each_tick.contacts,
            )
        joints = target
    assert 10 < touched < 550


def test_what_is_worn_farther_out_than_when_it_was_put_on_misses_nothing() -> None:
    """A finger on the axis of the last joint goes aside, and then turns into a ball about that axis."""
    model = MODELS[ARMS[0]]
    home = model.description.home

    def finger(aside_m: float) -> list[Worn]:
        place = (aside_m, 0.0, 0.05)
        return [Worn(Capsule("finger", 0, place, place, 0.01))]

    def tip(angle: float) -> tuple[tuple[float, ...], Vector]:
        joints = (*home[:-1], home[-1] + angle)
        return joints, apply(model.tcp_of_flange.pose(joints), (0.3, 0.0, 0.05))

    ball = surface(Sphere(0.02), at(*tip(0.2)[1]))
    arm = links_of(ARMS[0])
    arm.wear(finger(0.0))
    arm.surround({"ball": ball}, home)
    arm.step(home, TICK_S)
    arm.rewear(finger(0.3))
    felt = []
    for angle in np.linspace(0.0, 0.2, 201).tolist():
        joints, place = tip(angle)
        arm.step(joints, TICK_S)
        felt.append(depth_in(ball, (place, place), 0.01))
        assert bool(arm.contacts) == (felt[-1] > 0.0), angle
    assert felt[0] < 0.0 < felt[-1]


@given(
    st.sampled_from(ARMS),
    st.sampled_from(SHAPES),
    poses,
    st.lists(parts, min_size=2, max_size=4),
    st.floats(0.05, 2.0),
)
def test_whoever_moves_links_along_surfaces_gets_back_no_more_than_he_has_given(
    name: str, shape: Shape, pose: Transform, places: list[list[float]], friction: float
) -> None:
    """By springs that are wound and unwound: there and back again, over any way."""
    placed = surface(shape, pose, stiffness=1e3, friction=friction)
    ways = [joints_at(name, [0.4 * p for p in part]) for part in places]
    if not is_apart(name, placed, ways[0]):
        return
    links = links_of(name)
    links.surround({placed.name: placed}, ways[0])
    links.step(ways[0], TICK_S)
    work, before, at = 0.0, (0.0,) * 7, ways[0]
    for target in [*ways[1:], ways[0]]:
        for k in range(1, 201):
            joints = tuple(a + k / 200.0 * (b - a) for a, b in zip(at, target, strict=True))
            links.step(joints, TICK_S)
            torques = links.torques or (0.0,) * 7
            way = [(b - a) / 200.0 for a, b in zip(at, target, strict=True)]
            work -= sum(0.5 * (a + b) * w for a, b, w in zip(before, torques, way, strict=False))
            before = torques
        at = target
    assert work > -2e-3


def test_friction_holds_a_link_up_to_its_limit_and_is_unwound_on_the_way_back() -> None:
    name = ARMS[0]
    wall = surface(Box(0.6, 0.4, 0.6), at(0.0, 0.85, 0.6), stiffness=20_000.0, friction=0.02)
    links = links_of(name)
    stretched = (0.0, 0.9, 0.0, -1.0, 0.0, 1.2, 0.0)
    links.surround({wall.name: wall}, stretched)

    def feels(joints: tuple[float, ...]) -> LinkContact:
        links.step(joints, TICK_S)
        return links.contacts[0]

    links.step(stretched, TICK_S)
    links.step((0.88, *stretched[1:]), TICK_S)
    pressed = (0.9, *stretched[1:])
    first = feels(pressed)
    pressing = -first.force[1]
    up = feels((0.9, 0.8999, *stretched[2:]))
    assert 0.0 < -up.force[2] < 0.02 * pressing, "it is held back, as it goes up"
    for k in range(1, 60):
        up = feels((0.9, 0.9 - 0.0005 * k, *stretched[2:]))
    assert np.hypot(up.force[0], up.force[2]) == pytest.approx(-0.02 * up.force[1], rel=1e-6)
    back = feels((0.9, 0.9 - 0.0005 * 59 + 0.00005, *stretched[2:]))
    assert 0.0 < -back.force[2] < -up.force[2], "and the spring is unwound first"
