"""What the joints feel of a push at the TCP."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.contact.load import ExternalLoad
from iiwa_sim.frames import rotate
from tests.stepped import SteppedRobot, rotation_log

ROBOT = SteppedRobot()
STEP = 1e-6


@given(
    joints=st.tuples(*[st.floats(-1.9, 1.9)] * 7),
    wrench=st.tuples(*[st.floats(-100, 100, allow_subnormal=False)] * 6),
)
def test_joint_torques_do_the_work_of_the_wrench(
    joints: tuple[float, ...], wrench: tuple[float, float, float, float, float, float]
) -> None:
    load = ExternalLoad(7)
    load.wrench = wrench
    torques = load.joint_torques(ROBOT.model, joints, ROBOT.description.tool_in_flange)
    tcp = ROBOT.tcp(joints)
    force, torque = rotate(tcp.rotation, wrench[:3]), rotate(tcp.rotation, wrench[3:])
    for joint in range(7):
        ahead, behind = list(joints), list(joints)
        ahead[joint] += STEP
        behind[joint] -= STEP
        a, b = ROBOT.tcp(ahead), ROBOT.tcp(behind)
        moved = np.subtract(a.translation, b.translation)
        turned = rotation_log(np.reshape(a.rotation, (3, 3)) @ np.reshape(b.rotation, (3, 3)).T)
        work = (moved @ force + turned @ torque) / (2 * STEP)
        assert torques[joint] == pytest.approx(work, abs=1e-5)


def test_in_free_space_there_is_none() -> None:
    controller = SteppedRobot().controller
    assert controller.cartesian_force() == (0.0,) * 6
    assert controller.joint_torque() == (0.0,) * 7


def test_pushes_on_joints_add_up_with_the_wrench() -> None:
    robot = SteppedRobot()
    robot.controller.load.wrench = (0.0, 0.0, 10.0, 0.0, 0.0, 0.0)
    alone = robot.controller.joint_torque()
    robot.controller.load.joint_push = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
    np.testing.assert_allclose(np.subtract(robot.controller.joint_torque(), alone), range(1, 8))
    assert robot.controller.cartesian_force()[2] == 10.0
