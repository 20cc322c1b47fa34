import pytest
from driver import Driver, ProtocolError, RobotError

from iiwa_sim import Garble, Split


@pytest.fixture
def driver(iiwa):
    driver = Driver(iiwa.host, iiwa.port)
    yield driver
    driver.close()


def test_a_move_ends_at_its_target(iiwa, driver):
    driver.go("left")
    assert iiwa.state().tool_frame[:3] == pytest.approx([445, 250, 620], abs=0.001)
    assert driver.goal_mm() == pytest.approx([445, 250, 620], abs=0.001)


@pytest.mark.iiwa(clock="stepped")
def test_a_stop_in_mid_motion(iiwa, driver):
    driver.start("left")
    iiwa.advance(0.2)  # nothing moves until time passes
    driver.stop()
    assert iiwa.run_until_stopped() <= 0.1
    assert 0 < iiwa.state().tool_frame.y_mm < 250


def test_the_table_pushes_back(iiwa, driver):  # no message tells a force, but the state does
    driver.go("touching")
    assert iiwa.state().cartesian_force[2] == pytest.approx(-20, abs=0.001)


def test_an_emergency_stop_is_reported_and_reset(iiwa, driver):
    iiwa.backdoor.emergency_stop()
    with pytest.raises(RobotError, match="3030"):
        driver.go("left")
    iiwa.backdoor.emergency_stop(pressed=False)
    iiwa.backdoor.reset_error()  # no message does: on the real one it is a button of the panel
    driver.go("left")


def test_a_reply_in_two_pieces_and_a_garbled_one(iiwa, driver):
    iiwa.backdoor.set_fault(Split(100, pause_s=0.01), replies=1)
    iiwa.backdoor.set_fault(Garble(), replies=1)
    assert driver.goal_mm() == pytest.approx([445, 0, 710])
    with pytest.raises(ProtocolError):
        driver.goal_mm()
    assert driver.goal_mm() == pytest.approx([445, 0, 710])
