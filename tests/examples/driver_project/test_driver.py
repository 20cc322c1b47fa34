import pytest
from driver import Driver, RobotError


@pytest.fixture
def driver(iiwa):
    driver = Driver(iiwa.host, iiwa.port)
    yield driver
    driver.close()


def test_the_robot_goes_where_it_is_sent(iiwa, driver):
    driver.go("left", speed_rel=0.05)  # some seconds of motion
    assert driver.tool_frame()[:3] == pytest.approx([450, 200, 520], abs=0.001)
    assert iiwa.state().time_s > 3  # simulated: it took a fraction of that


def test_an_emergency_stop_is_told(iiwa, driver):
    iiwa.backdoor.emergency_stop()
    with pytest.raises(RobotError, match="3030"):
        driver.go("left")


@pytest.mark.iiwa(robot="lbr_iiwa_14_r820", clock="stepped")
def test_the_robot_is_seen_on_its_way(iiwa, driver):
    driver.start("left")
    before = driver.tool_frame()[1]
    iiwa.advance(0.2)  # nothing moves until time passes
    assert before < driver.tool_frame()[1] < 200
    iiwa.run_until_stopped()
    assert driver.tool_frame()[1] == pytest.approx(200)
