"""8. Pick and place with force moves, from a table into a fixture, in the cell examples/fixture.toml.

Run `python examples/08_pick.py`. Output 1 closes the gripper; input 3 is on while it holds a part.
"""

from pathlib import Path

from iiwa_sim import Iiwa, Simulator

CELL = Path(__file__).with_name("fixture.toml")
DOWN, CLOSE, HOLDS = (3.14159265, 0, 3.14159265), 1, 3


def feel(robot: Iiwa, x_mm: float, y_mm: float) -> float:
    """Move down until a force acts, and return the height of the TCP (mm)."""
    robot.ptp_move((x_mm, y_mm, 360, *DOWN), speed=0.5, blending=0)
    robot.wait_until_stopped(timeout_s=60)  # thresholds count from the force at the command
    robot.linforcez_move((x_mm, y_mm, 290, *DOWN), speed=0.005, blending=0, thresholdZ=10)
    robot.wait_until_stopped(timeout_s=60)
    return robot.get_tool_frame().z


def main() -> None:
    with Simulator(cell=CELL, clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        table_mm = feel(robot, 600, 100)
        robot.ptp_move((600, 0, 380, *DOWN), speed=0.5, blending=0)
        robot.lin_move((600, 0, table_mm + 15, *DOWN), speed=0.2, blending=0)
        robot.wait_until_stopped(timeout_s=60)
        robot.set_output(CLOSE, value=True)
        held = any(robot.get_input(HOLDS) for _ in range(9999))
        robot.set_tool_load(1.4, (0, 0, (0.9 * 60 + 0.5 * 150) / 1.4))  # the gripper, and the block
        robot.lin_relative_move((0, 0, 80, 0, 0, 0), speed=0.2, blending=0)
        put_mm = feel(robot, 500, 200)
        robot.set_output(CLOSE, value=False)
        print(f"table at {table_mm:.1f} mm, gripped: {held}, put down at {put_mm:.1f} mm")


if __name__ == "__main__":
    main()
