"""3. Tests of a driver: run `pytest examples/03_test_a_driver.py`.

The fixture `iiwa` starts a robot for each test. `Iiwa` stands for your driver. A test can check its dialogue,
and choose the replies.
"""

import pytest

from iiwa_sim import CommandError, Iiwa, Simulator


@pytest.fixture
def driver(iiwa: Simulator):
    with Iiwa(iiwa.host, iiwa.port) as driver:
        yield driver


def test_driver_arrives(iiwa: Simulator, driver: Iiwa) -> None:
    driver.lin_move((450, 200, 520, 0, -1.57079, 0), speed=0.5, blending=0)
    driver.wait_until_stopped(timeout_s=30)
    assert iiwa.state().tool_frame.y_mm == pytest.approx(200)
    iiwa.dialogue.assert_said("lin move", times=1)


def test_driver_waits_while_the_robot_moves(iiwa: Simulator, driver: Iiwa) -> None:
    iiwa.reply("get status", "moving", times=3)
    driver.wait_until_stopped(timeout_s=30)
    iiwa.dialogue.assert_said("get status", times=4)


def test_emergency_stop_is_an_error(iiwa: Simulator, driver: Iiwa) -> None:
    iiwa.backdoor.emergency_stop()
    with pytest.raises(CommandError):
        driver.lin_move((450, 200, 520, 0, -1.57079, 0), speed=0.5, blending=0)
    assert driver.get_error().code == 3030
