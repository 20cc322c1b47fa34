"""Pack 24 boxes in two layers, and notice a lost one.

Run `python examples/palletising.py`. The cell is examples/boxes.toml: output 1 closes the gripper, and inputs
report `open`, `closed` and `holds`. Each box is put down with a force move, so the program needs no
heights of the layers.
"""

import time
from collections.abc import Callable
from pathlib import Path

from iiwa_sim import Iiwa, Simulator

CELL = Path(__file__).with_name("boxes.toml")
DOWN = (3.14159265, 0, 3.14159265)
CLOSE = 1  # the number of the output
OPEN, CLOSED, HOLDS = 1, 2, 3  # and of the inputs
TOOL_KG, TOOL = 0.9, (0, 0, 60)
BOX_KG = 0.2
GRASP_MM = 315  # height of the middle of a box on the table
ABOVE_MM = 80
FROM = [(400 + 55 * i, -350 + 70 * j) for j in range(6) for i in range(4)]
TO = [(400 + 45 * i, 140 + 70 * j) for _ in range(2) for j in range(3) for i in range(4)]

Wait = Callable[[float], None]


class PartLost(Exception):
    """The gripper holds no box."""


def wait_for(robot: Iiwa, *inputs: int, wait: Wait) -> int:
    """Wait for one of these inputs, and return its number."""
    for _ in range(1000):
        for number in inputs:
            if robot.get_input(number):
                return number
        wait(0.01)
    raise TimeoutError(f"none of the inputs {inputs} has come on")


def done(robot: Iiwa, wait: Wait) -> None:
    """Wait until the robot has stopped."""
    while robot.get_status() == "moving":
        wait(0.01)


def settled(robot: Iiwa, wait: Wait) -> None:
    """Wait until the force stays constant: the stack of boxes is at rest."""
    before, times = robot.get_cartesian_force(), 0
    while times < 3:
        wait(0.02)
        now = robot.get_cartesian_force()
        before, times = now, times + 1 if now == before else 0


def pick(robot: Iiwa, x_mm: float, y_mm: float, wait: Wait = time.sleep) -> None:
    """Grip a box at a place of the table, and lift it."""
    robot.ptp_move((x_mm, y_mm, GRASP_MM + ABOVE_MM, *DOWN), speed=1, blending=0)
    robot.lin_move((x_mm, y_mm, GRASP_MM, *DOWN), speed=0.3, blending=0)
    done(robot, wait)
    robot.set_output(CLOSE, value=True)
    if wait_for(robot, HOLDS, CLOSED, wait=wait) == CLOSED:
        raise PartLost(f"there is no box at {x_mm:g} {y_mm:g}")
    robot.set_tool_load(TOOL_KG + BOX_KG, (0, 0, (TOOL_KG * TOOL[2] + BOX_KG * 150) / (TOOL_KG + BOX_KG)))
    robot.lin_move((x_mm, y_mm, GRASP_MM + ABOVE_MM, *DOWN), speed=0.5, blending=0)
    done(robot, wait)


def put(robot: Iiwa, x_mm: float, y_mm: float, wait: Wait = time.sleep) -> float:
    """Put the held box down until it touches, and return the height (mm) of the TCP there."""
    robot.ptp_move((x_mm, y_mm, GRASP_MM + ABOVE_MM, *DOWN), speed=1, blending=0)
    done(robot, wait)
    if not robot.get_input(HOLDS):
        raise PartLost("the box has been lost on its way")
    robot.linforcez_move((x_mm, y_mm, GRASP_MM - 10, *DOWN), speed=0.05, blending=0, thresholdZ=8)
    done(robot, wait)
    felt_mm = robot.get_tool_frame().z
    settled(robot, wait)
    robot.set_output(CLOSE, value=False)
    wait_for(robot, OPEN, wait=wait)
    robot.set_tool_load(TOOL_KG, TOOL)
    robot.lin_move((x_mm, y_mm, GRASP_MM + ABOVE_MM, *DOWN), speed=0.5, blending=0)
    done(robot, wait)
    return felt_mm


def palletise(robot: Iiwa, wait: Wait = time.sleep) -> list[float]:
    """Pack all 24 boxes, and return the heights (mm) at which they touched."""
    heights = []
    for start, end in zip(FROM, TO, strict=True):
        pick(robot, *start, wait=wait)
        heights.append(put(robot, *end, wait=wait))
    return heights


def main() -> None:
    with Simulator(cell=CELL, clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        heights = palletise(robot, wait=lambda _: None)
        lower, upper = (sum(heights[layer : layer + 12]) / 12 for layer in (0, 12))
        time_s = simulator.state().time_s
        print(f"{len(heights)} boxes in {time_s:.0f} s, layers felt at {lower:.0f} and {upper:.0f} mm")


if __name__ == "__main__":
    main()
