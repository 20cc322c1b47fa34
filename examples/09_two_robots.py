"""9. Two robots in one cell: the left one picks a bar up and hands it to the right one.

Run `python examples/09_two_robots.py`. Each robot of examples/two_iiwas.toml has its own controller and port.
They share the time, the table and the bar, and stop when they collide.
"""

from contextlib import ExitStack
from pathlib import Path

from iiwa_sim import Iiwa, Simulator

CELL = Path(__file__).with_name("two_iiwas.toml")
DOWN, LEVEL = (3.14159265, 0, 3.14159265), (0, 1.57079633, 0)
CLOSE, HOLDS = 1, 3


def grip(robot: Iiwa) -> None:
    robot.set_output(CLOSE, value=True)
    while not robot.get_input(HOLDS):
        pass


def main() -> None:
    with ExitStack() as running:
        cell = running.enter_context(Simulator(cell=CELL, clock="fast"))
        left, right = (running.enter_context(Iiwa(each.host, each.port)) for each in cell.robots.values())
        left.ptp_move((550, -200, 450, *DOWN), speed=0.5, blending=0)
        left.lin_move((550, -200, 400, *DOWN), speed=0.2, blending=0)
        left.wait_until_stopped(timeout_s=60)
        grip(left)
        left.lin_move((550, 0, 500, *DOWN), speed=0.5, blending=0)
        right.ptp_move((680, 0, 455, *LEVEL), speed=0.5, blending=0)
        left.wait_until_stopped(timeout_s=60)
        right.lin_move((740, 0, 455, *LEVEL), speed=0.2, blending=0)
        right.wait_until_stopped(timeout_s=60)
        grip(right)  # both hold the bar now, and the left robot leads it
        left.set_output(CLOSE, value=False)
        while left.get_input(HOLDS):
            pass
        left.lin_move((550, 0, 600, *DOWN), speed=0.5, blending=0)
        right.lin_move((660, 0, 455, *LEVEL), speed=0.2, blending=0)
        right.wait_until_stopped(timeout_s=60)
        (bar,) = cell.robots["left"].state().parts
        print("handed over:", bar.state, "at", *map(round, bar.frame[:3]))


if __name__ == "__main__":
    main()
