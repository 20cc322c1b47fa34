"""A driver for KRC4 messages in Python: `python examples/client_krc4.py 127.0.0.1 54600`.

Prints where the robot is, moves the TCP 50 mm to the side on a straight line, waits until the robot has
stopped, and moves back. It imports nothing of the simulator but `iiwa_sim.client`.
"""

import sys

from iiwa_sim.client import Krc4, Krc4Error


def main(host: str, port: int) -> None:
    with Krc4(host, port) as robot:  # axes=7 for an iiwa
        robot.wait_until_stopped(timeout_s=30)  # GOA and GOP then tell where the robot is
        joints_deg = robot.goa()
        start = robot.gop()
        print("joints", *joints_deg)
        print("start", *start)

        robot.lin(start._replace(y_mm=start.y_mm + 50))
        robot.wait_until_stopped(timeout_s=30)
        print("there", *robot.gop())

        try:
            robot.lin(start._replace(x_mm=start.x_mm + 5000))
        except Krc4Error as refused:
            print("refused:", refused.code)

        robot.pta(joints_deg)
        robot.wait_until_stopped(timeout_s=30)
        print("back", *robot.gop())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
