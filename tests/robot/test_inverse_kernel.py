"""The closed forms compiled and as Python runs their text: the same to the last bit, regular or not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.robot import opw_kernel, srs_kernel
from iiwa_sim.robot.inverse_kernel import NEAR, OUT_OF_REACH, REGULAR
from iiwa_sim.robot.opw import opw
from iiwa_sim.robot.srs import srs
from tests.interpreted import interpreted
from tests.robot.arms import BUILT_IN, SIX_AXES, arm_named

PLAIN_SRS = interpreted("iiwa_sim.robot.srs_kernel")
PLAIN_OPW = interpreted("iiwa_sim.robot.opw_kernel")
PLAIN = interpreted("iiwa_sim.robot.inverse_kernel")


@pytest.mark.parametrize("name", BUILT_IN)
@given(
    seed=st.integers(0, 2**32 - 1),
    status=st.integers(0, 7),
    zeros=st.sets(st.integers(1, 5)),
    longer=st.sampled_from([1.0, 1.0 + 1e-13, 1.05, 2.0]),
)
def test_compiled_and_interpreted_are_the_same(
    name: str, seed: int, status: int, zeros: set[int], longer: float
) -> None:
    arm = arm_named(name)
    compiled, plain = (opw_kernel, PLAIN_OPW) if name == SIX_AXES else (srs_kernel, PLAIN_SRS)
    (q, seeds) = arm.anywhere(np.random.default_rng(seed), 2)
    q[list(zeros)] = 0.0
    rotation, (x, y, z) = arm.model.flange(q.tolist())
    poses = np.array([(*rotation, longer * x, longer * y, z)])
    found = []
    for kernel in (compiled, plain):
        joints = np.zeros((1, len(q)))
        result = kernel.solve(
            arm.inverse.numbers, poses, 0, arm.inverse.redundancy(q.tolist()), status, seeds, 4e-10, joints
        )
        assert result in {REGULAR, NEAR, OUT_OF_REACH}
        found.append((result, joints.tolist()))
    assert found[0] == found[1]


@pytest.mark.parametrize("name", BUILT_IN)
@given(seed=st.integers(0, 2**32 - 1), zeros=st.sets(st.integers(1, 5)))
def test_branches_and_the_nearest_of_them(name: str, seed: int, zeros: set[int]) -> None:
    arm = arm_named(name)
    compiled = arm.inverse
    plain = PLAIN.Inverse(arm.model, (opw if name == SIX_AXES else srs)(arm.model))
    (present, there) = arm.anywhere(np.random.default_rng(seed), 2).tolist()
    for zero in zeros:
        there[zero] = 0.0
    flange = arm.model.flange(there)
    assert compiled.distances(there) == plain.distances(there)
    assert compiled.merging_statuses(there) == plain.merging_statuses(there)
    assert (compiled.turning_point(there) is None) == (plain.turning_point(there) is None)
    for statuses in ([compiled.status(present)], compiled.statuses):
        one, other = (each.nearest(flange, there[2], statuses, present) for each in (compiled, plain))
        assert one == other
