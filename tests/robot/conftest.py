"""The arms that come along, ready to be asked."""

from __future__ import annotations

import pytest

from tests.robot.arms import BUILT_IN, Arm, arm_named


@pytest.fixture(params=BUILT_IN)
def arm(request: pytest.FixtureRequest) -> Arm:
    return arm_named(request.param)
