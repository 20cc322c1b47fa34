"""Links of an arm that meet each other: when, and what that does to its joints."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.itself_kernel import STIFFNESS_N_PER_M, Itself
from iiwa_sim.robot.capsules import Capsule, capsules_of
from tests.contact.test_links import MODELS, joints_at, parts
from tests.interpreted import interpreted
from tests.samples import some
from tests.stepped import ARMS, ROBOTS

TICK_S = 0.002
FOLDED = (0.0, 2.0, 0.0, -2.09, 0.0, 0.0, 0.0)


def itself(name: str, worn: tuple[Capsule, ...] = (), kind: type[Itself] = Itself) -> Itself:
    model = MODELS[name]
    at, capsules = model.description, capsules_of(model.description)
    return kind(model.tcp_of_flange.fixed, capsules, worn, at.home, at.velocity)


def look(arm: Itself, joints: Sequence[float]) -> None:
    """Have it look at all pairs, whatever it knows of where they were."""
    arm.forget()
    arm.watch(joints, TICK_S)


@pytest.mark.parametrize("name", ROBOTS)
def test_an_arm_at_home_and_stretched_does_not_meet_itself(name: str) -> None:
    arm, description = itself(name), MODELS[name].description
    for joints in (description.home, (0.0,) * len(description.joints)):
        look(arm, joints)
        assert arm.torques is None
        assert arm.colliding is None
        assert arm.free_m > 0.05


def test_an_arm_that_folds_onto_its_base_meets_it() -> None:
    arm = itself(ARMS[0])
    look(arm, FOLDED)
    assert arm.colliding == ("iiwa_link_0", "iiwa_link_5")
    assert arm.free_m < 0.0
    assert arm.torques[5:] == (0.0, 0.0), "link 5 meets it, so joints beyond are not pushed"


def test_a_tool_that_is_turned_back_meets_the_arm() -> None:
    rod = Capsule("tool", 0, (0.0, 0.0, 0.05), (0.0, 0.0, 0.4), 0.02)
    arm = itself(ARMS[0], (rod,))
    look(arm, (0.0, 0.6, 0.0, -2.0, 0.0, 1.9, 0.0))
    assert arm.colliding is not None
    assert arm.colliding[1] == "tool"
    without = itself(ARMS[0])
    look(without, (0.0, 0.6, 0.0, -2.0, 0.0, 1.9, 0.0))
    assert without.colliding is None


@settings(max_examples=some(200))
@given(st.sampled_from(ARMS), parts)
def test_torques_are_what_the_depths_of_pairs_store(name: str, part: list[float]) -> None:
    """The torques are against the slope of half the stiffness times the square of the depth, of each pair."""
    model, joints = MODELS[name], joints_at(name, part)
    arm, capsules = itself(name), capsules_of(model.description)
    home, velocity = model.description.home, model.description.velocity
    look(arm, joints)
    if arm.torques is None:
        assert arm.free_m >= 0.0
        return
    total, step = np.zeros(len(joints)), 1e-6
    for number, a in enumerate(capsules):
        for b in capsules[number + 1 :]:
            pair = Itself(model.tcp_of_flange.fixed, (a, b), (), home, velocity)
            look(pair, joints)
            if pair.torques is None:
                continue
            total += pair.torques
            depth = -pair.free_m
            for k, torque in enumerate(pair.torques):
                ends = []
                for turn in (-step, step):
                    look(pair, (*joints[:k], joints[k] + turn, *joints[k + 1 :]))
                    ends.append(pair.free_m)
                slope = (ends[1] - ends[0]) / (2.0 * step)
                assert torque == pytest.approx(STIFFNESS_N_PER_M * depth * slope, rel=1e-3, abs=1e-2)
    assert arm.torques == pytest.approx(total.tolist(), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_no_pose_in_which_the_shapes_of_the_urdf_are_clear_is_a_touch(name: str) -> None:
    """Ten thousand random poses, and `coal` as the judge; of some hundred more that are not clear, most are
    touches."""
    description = MODELS[name].description
    model = pin.buildModelFromXML(description.urdf)
    geometry = pin.buildGeomFromUrdfString(model, description.urdf, pin.GeometryType.COLLISION)
    capsules = capsules_of(description)
    moved_by = {capsule.link: capsule.joints for capsule in capsules}
    link_of = [model.frames[each.parentFrame].name for each in geometry.geometryObjects]
    for a in range(len(link_of)):
        for b in range(a + 1, len(link_of)):
            both = [moved_by.get(link_of[each]) for each in (a, b)]
            if None not in both and abs(both[0] - both[1]) >= 3:  # type: ignore[operator]
                geometry.addCollisionPair(pin.CollisionPair(a, b))
    data, shapes = model.createData(), pin.GeometryData(geometry)
    arm, rng = itself(name), np.random.default_rng(21)
    order = [model.joints[model.getJointId(joint)].idx_q for joint in description.joints]
    clear = meets = found = 0
    for _ in range(some(10_000) + 200):
        joints = rng.uniform(description.position_min, description.position_max)
        q = pin.neutral(model)
        q[order] = joints
        meets_itself = pin.computeCollisions(model, data, geometry, shapes, q, True)
        look(arm, tuple(joints.tolist()))
        if meets_itself:
            meets, found = meets + 1, found + (arm.torques is not None)
        else:
            clear += 1
            assert arm.torques is None, (joints, arm.colliding)
    assert clear > 100
    assert found > 0 or meets < 10


def test_compiled_and_interpreted_find_the_same_bits() -> None:
    plain = interpreted("iiwa_sim.contact.itself_kernel")
    rng, touched = np.random.default_rng(5), 0
    for name in ARMS:
        rod = Capsule("tool", 0, (0.0, 0.0, 0.05), (0.0, 0.0, 0.3), 0.03)
        arms = [itself(name, (rod,), kind) for kind in (Itself, plain.Itself)]
        for _ in range(40):
            joints = joints_at(name, rng.uniform(-0.99, 0.99, 7).tolist())
            for arm in arms:
                look(arm, joints)
            touched += arms[0].torques is not None
            assert arms[0].torques == arms[1].torques
            assert arms[0].free_m == arms[1].free_m
            assert arms[0].colliding == arms[1].colliding
    assert touched > 1


@settings(max_examples=some(60))
@given(st.sampled_from(ARMS), st.lists(parts, min_size=2, max_size=6), st.floats(0.05, 1.0))
def test_looks_when_they_are_due_find_what_looks_in_every_tick_find(
    name: str, through: list[list[float]], speed: float
) -> None:
    """On ways through random poses, no joint faster than it may be, links push each other so."""
    velocity = np.array(MODELS[name].description.velocity)
    watched, looked_at = itself(name), itself(name)
    due = tick = 0
    poses = [np.array(joints_at(name, part)) for part in through]
    for start, end in pairwise(poses):
        ticks = int(np.ceil(np.max(np.abs(end - start) / velocity) / (speed * TICK_S)))
        step = 1 + ticks // 300
        for at in range(0, ticks, step):
            joints = tuple((start + (end - start) * at / ticks).tolist())
            tick += step
            if tick >= due:
                due = tick + watched.watch(joints, TICK_S)
            look(looked_at, joints)
            assert watched.torques == looked_at.torques
            assert watched.colliding == looked_at.colliding
