"""The transforms on /tf chain up to where the robot is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model, arm_model
from iiwa_sim.ros.arm.links import Links, tool_transform
from tests.samples import some
from tests.stepped import ROBOTS

Array = NDArray[np.float64]


def matrix(told: dict[str, Any]) -> Array:
    x, y, z, w = (told["transform"]["rotation"][name] for name in "xyzw")
    whole = np.eye(4)
    whole[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    whole[:3, 3] = [told["transform"]["translation"][name] for name in "xyz"]
    return whole


@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=some(20), deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_chain_of_links_ends_in_the_flange(name: str, seed: int) -> None:
    description = load_robot(name)
    random = np.random.default_rng(seed)
    joints = random.uniform(description.position_min, description.position_max).tolist()
    links = Links(arm_model(description).links)
    told = {each["child_frame_id"]: each for each in (*links.moving(joints), *links.fixed())}
    pose, link = np.eye(4), description.flange
    while link in told:
        pose = matrix(told[link]) @ pose
        link = told[link]["header"]["frame_id"]
    flange = Model(description).flange(joints)
    assert np.abs(pose[:3, :3].ravel() - flange.rotation).max() < 1e-9
    assert np.abs(pose[:3, 3] - flange.translation).max() < 1e-9


@settings(max_examples=some(40), deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: sum(x * x for x in q) > 0.01))
def test_any_tool_is_told_as_it_is(quaternion: list[float]) -> None:
    told = {
        "transform": {
            "translation": {"x": 0.1, "y": 0.2, "z": 0.3},
            "rotation": dict(zip("xyzw", np.array(quaternion) / np.linalg.norm(quaternion), strict=True)),
        }
    }
    whole = matrix(told)
    rotation = tuple(whole[:3, :3].ravel().tolist())
    found = tool_transform("flange", "tool", Transform(rotation, (0.1, 0.2, 0.3)))  # type: ignore[arg-type]
    assert np.abs(matrix(found) - whole).max() < 1e-9
    assert (found["header"]["frame_id"], found["child_frame_id"]) == ("flange", "tool")
