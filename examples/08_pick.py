"""8. A pick with force: down until the part is felt, grip, up again.

`python examples/08_pick.py`. The part is the knob on the table of examples/table.toml, gripped by output 1;
that it is in the gripper would be told by input 1, which the test bench switches here.
"""

from pathlib import Path

from iiwa_sim import Iiwa, Simulator

CELL = Path(__file__).with_name("table.toml")
DOWN = (3.14159265, 0, 3.14159265)
GRIP, GRIPPED = 1, 1  # numbers of the output and of the input


def pick(robot: Iiwa, x_mm: float, y_mm: float) -> float:
    """The height (mm) at which the part was felt."""
    robot.ptp_move((x_mm, y_mm, 380, *DOWN), speed=0.5, blending=0)
    robot.linforcez_move((x_mm, y_mm, 300, *DOWN), speed=0.02, blending=0, thresholdZ=10)
    robot.wait_until_stopped(timeout_s=60)
    felt_mm = robot.get_tool_frame().z
    robot.set_output(GRIP, value=True)
    robot.lin_relative_move((0, 0, 60, 0, 0, 0), speed=0.2, blending=0)
    robot.wait_until_stopped(timeout_s=60)
    return felt_mm


def main() -> None:
    with Simulator(cell=CELL, clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        felt_mm = pick(robot, 600, 200)
        simulator.backdoor.set_input(GRIPPED, on=True)
        print(f"felt at {felt_mm:.1f} mm, gripped: {robot.get_input(GRIPPED) == 1}")


if __name__ == "__main__":
    main()
