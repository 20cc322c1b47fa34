"""A driver in Python: `python examples/client.py 127.0.0.1 30000`.

Prints where the robot is, moves the TCP 50 mm to the side on a straight line, waits until the robot has
stopped, and moves back. It imports nothing of the simulator but `iiwa_sim.client`.
"""

import sys

from iiwa_sim.client import CommandError, Iiwa


def main(host: str, port: int) -> None:
    with Iiwa(host, port) as robot:
        print("joints", *robot.get_joint_position())
        start = robot.get_tool_frame()
        print("start", *start)

        robot.lin_move(start._replace(y=start.y + 50), speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=30)
        print("there", *robot.get_tool_frame())

        try:
            robot.lin_move(start._replace(x=start.x + 5000), speed=0.5, blending=0)
        except CommandError:
            print("refused:", robot.get_error().reason)

        robot.ptp_move(start, speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=30)
        print("back", *robot.get_tool_frame())
        robot.bye()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
