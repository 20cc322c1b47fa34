"""A protective stop, as a driver sees it."""

from iiwa_sim import Iiwa, Simulator


def test_a_driver_reads_why_the_robot_stopped_itself_and_resets_it() -> None:
    with Simulator(port=0, clock="stepped") as simulator, Iiwa("127.0.0.1", simulator.port) as robot:
        robot.set_collision_detection(80.0, 0.0)
        assert robot.get_collision_detection() == (80.0, 0.0)
        simulator.backdoor.push((0.0, 0.0, 90.0, 0.0, 0.0, 0.0))
        simulator.advance(0.01)
        assert (robot.get_robot_status().in_error, robot.get_robot_status().error_code) == (1, 3060)
        error = robot.get_error()
        assert error.code == 3060
        assert error.reason == (
            "protective stop: collision: the external force at the TCP is 90.0 N, its threshold is 80 N"
        )
        robot.reset_error()
        assert robot.get_error().code == 0
