"""12. A hand-over: the robot offers a part, and releases it when a person pulls.

Run `python examples/12_hand_over.py`. The robot yields like a spring of 1000 N/m, and opens the gripper,
output 1, above 12 N. The backdoor plays the person: it pulls a little, and then harder.
"""

from math import dist, hypot

from iiwa_sim import Iiwa, Simulator

OFFER = (500, 200, 500, 0, -1.57079, 0)
GRIP = 1
LETS_GO_N = 12


def pulled_n(robot: Iiwa) -> float:
    force = robot.get_cartesian_force()
    return hypot(force.fx, force.fy, force.fz)


def main() -> None:
    with Simulator(clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        robot.set_output(GRIP, value=True)
        robot.ptp_move(OFFER, speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=60)
        robot.linstiff_move(OFFER, 0.1, 1000, (0, 0, 0, 0, 0, 0))
        for pull_n in (5, 20):
            simulator.backdoor.push((0, pull_n, 0, 0, 0, 0))
            simulator.advance(1)
            gave_mm = dist(robot.get_tool_frame()[:3], OFFER[:3])
            if pulled_n(robot) > LETS_GO_N:
                robot.set_output(GRIP, value=False)
            print(f"{pull_n} N: gave way {gave_mm:.1f} mm, holds on: {robot.get_output(GRIP) == 1}")
        simulator.backdoor.release()
        robot.ptp_move((450, 0, 520, *OFFER[3:]), speed=0.3, blending=0)


if __name__ == "__main__":
    main()
