"""A robot on the graph of ROS 2 and a user, for all tests of a file that leave it at rest."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from iiwa_sim.simulator import Simulator
from tests.ros.ros2.users import CELL, User, compiled, rclpy_python, user
from tests.talking import wait_until


@pytest.fixture(scope="module")
def python() -> Iterator[Path]:
    """An interpreter that has rclpy."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield rclpy_python(monkeypatch)


@pytest.fixture(scope="module")
def whole_python(python: Path) -> Path:
    """One that has the types that no wheel has, too."""
    compiled(python)
    return python


@pytest.fixture(scope="module")
def shared(whole_python: Path) -> Iterator[tuple[Simulator, User]]:
    """A robot whose time runs ten times as fast, and a user.

    It ends with its file: robots that others start in this domain would share its /clock.
    """
    with (
        Simulator(
            clock="10x", ros2=True, ros2_python=whole_python, ros_namespace=CELL, rosbridge_port=0
        ) as robot,
        user(whole_python) as someone,
    ):
        yield robot, someone


@pytest.fixture
def cell(shared: tuple[Simulator, User]) -> tuple[Simulator, User]:
    """These two, with the robot as it was at its start: the test before may have left it on its way."""
    robot, _ = shared

    def begins() -> bool:
        if robot.controller.moving:
            robot.controller.stop()
            return False
        robot.backdoor.restore_state("start")
        return True

    wait_until(lambda: robot.call(begins))
    return shared
