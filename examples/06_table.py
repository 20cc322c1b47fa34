"""6. A table: a cell with a surface, and a move that ends at a force.

`python examples/06_table.py` moves down until 15 N push back, and computes the height of the table.
"""

from pathlib import Path

from iiwa_sim import Iiwa, Simulator

TABLE = Path(__file__).with_name("table.toml")  # its top is at z = 300 mm
DOWN = (3.14159265, 0, 3.14159265)
RADIUS_MM = 3  # contact_radius_mm of the cell
STIFFNESS_N_PER_MM = 20


def main() -> None:
    with Simulator(cell=TABLE, clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        robot.ptp_move((560, -100, 330, *DOWN), speed=0.3, blending=0)
        robot.linforcez_move((560, -100, 280, *DOWN), 0.02, blending=0, thresholdZ=15)
        robot.wait_until_stopped(timeout_s=60)
        force_n, z_mm = -robot.get_cartesian_force().fz, robot.get_tool_frame().z
        pressed_mm = force_n / STIFFNESS_N_PER_MM  # penetration at rest, after the robot has braked
        height_mm = z_mm - RADIUS_MM + pressed_mm
        print(f"{force_n:.1f} N at {z_mm:.2f} mm: the table is at {height_mm:.2f} mm")
        assert abs(height_mm - 300) < 0.1


if __name__ == "__main__":
    main()
