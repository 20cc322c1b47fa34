"""The robot behind Appendix A and the joint interface."""

import pytest

from tests.ros_robot import RosRobot


@pytest.fixture
def robot() -> RosRobot:
    return RosRobot()
