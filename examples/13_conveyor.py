"""13. Pick blocks from a moving conveyor when a light barrier sees them, in the cell examples/conveyor.toml.

Run `python examples/13_conveyor.py`. Output 1 closes the gripper, output 2 runs the belt; input 3 is on while
the gripper holds a block, input 4 while one is in the light barrier. Time passes as the program waits.
"""

from collections.abc import Callable
from pathlib import Path

from iiwa_sim import Iiwa, Simulator

CELL = Path(__file__).with_name("conveyor.toml")
ACROSS = (1.57079633, 0, 3.14159265)
"""Orientation of a tool that points down, with its jaws beside the belt."""
GRIP, BELT, HOLDS, SEEN = 1, 2, 3, 4
BARRIER_MM, HALF_BLOCK_MM, MM_PER_S, CLOSING_S = -250, 20, 100, 0.15
PICK, TRAY = (500, 0, 412), (400, 350, 322)

Wait = Callable[[float], None]
"""Waits for seconds of simulated time."""


def moved(robot: Iiwa, wait: Wait, x: float, y: float, z: float) -> None:
    robot.lin_move((x, y, z, *ACROSS), speed=0.4, blending=0)
    while robot.get_status() == "moving":
        wait(0.02)


def until(robot: Iiwa, wait: Wait, number: int) -> None:
    """Wait for an input."""
    while not robot.get_input(number):
        wait(0.002)


def pick(robot: Iiwa, wait: Wait) -> None:
    """Hold the jaws open beside the belt, and close them when the block that was seen is between them."""
    moved(robot, wait, *PICK)
    robot.set_output(BELT, value=True)
    until(robot, wait, SEEN)
    wait((PICK[1] - BARRIER_MM + HALF_BLOCK_MM) / MM_PER_S - CLOSING_S)
    robot.set_output(GRIP, value=True)
    until(robot, wait, HOLDS)
    robot.set_output(BELT, value=False)


def place(robot: Iiwa, wait: Wait, number: int) -> None:
    """Put a block into the tray, beside those before it."""
    x, y, z = TRAY[0] + 60 * number, *TRAY[1:]
    for height in (100, 0):
        moved(robot, wait, x, y, z + height)
    robot.set_output(GRIP, value=False)
    wait(0.4)
    moved(robot, wait, x, y, z + 100)


def main() -> None:
    with Simulator(cell=CELL, clock="stepped") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        for number in range(3):
            pick(robot, simulator.advance)
            moved(robot, simulator.advance, PICK[0], PICK[1], PICK[2] + 100)
            place(robot, simulator.advance, number)
        for part in simulator.state().parts:
            print(f"{part.name} {part.state} at {part.frame.x_mm:.1f} {part.frame.y_mm:.1f} mm")


if __name__ == "__main__":
    main()
