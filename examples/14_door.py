"""14. Reach into a machine whose door has to be open, in the cell examples/door.toml.

Run `python examples/14_door.py`. Output 1 opens the door, input 1 is on while it is open. A program that does
not look at the input collides: a protective stop names the door.
"""

from collections.abc import Callable
from pathlib import Path

from iiwa_sim import CommandError, Iiwa, Simulator

CELL = Path(__file__).with_name("door.toml")
AHEAD = (0, 1.57079633, 0)
"""Orientation of a tool that points along x of the base."""
OPEN, IS_OPEN = 1, 1
OUTSIDE, INSIDE = (620, 0, 520), (880, 0, 520)

Wait = Callable[[float], None]
"""Waits for seconds of simulated time."""


def moved(robot: Iiwa, wait: Wait, place: tuple[float, float, float]) -> None:
    """Move the TCP there. Raises CommandError if the robot stops for an error."""
    robot.lin_move((*place, *AHEAD), speed=0.3, blending=0)
    while robot.get_status() == "moving":
        wait(0.02)
    if robot.get_error().code:
        raise CommandError(robot.get_error().reason)


def reach_in(robot: Iiwa, wait: Wait, looks: bool = True) -> None:
    """Open the door, go in when the input tells that it is open, come out and close it."""
    robot.set_output(OPEN, value=looks)
    while looks and not robot.get_input(IS_OPEN):
        wait(0.02)
    moved(robot, wait, INSIDE)
    moved(robot, wait, OUTSIDE)
    robot.set_output(OPEN, value=False)


def main() -> None:
    with Simulator(cell=CELL, clock="stepped") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        robot.ptp_move((*OUTSIDE, *AHEAD), speed=0.5, blending=0)
        simulator.run_until_stopped(10)
        reach_in(robot, simulator.advance)
        print(f"back at {robot.get_tool_frame().x:.0f} mm")
        simulator.advance(3)
        try:
            reach_in(robot, simulator.advance, looks=False)
        except CommandError as fault:
            print(fault)


if __name__ == "__main__":
    main()
