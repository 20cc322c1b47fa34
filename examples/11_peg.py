"""11. A peg into a hole at an unknown place: a search spiral of stiffness moves.

Run `python examples/11_peg.py`. The hole of examples/peg.toml is 20 mm wide for a peg of 19 mm, 8 mm off the
assumed place. A spring presses the peg on the rim along a spiral until it sinks in, then to the bottom.
"""

from math import cos, sin, tau
from pathlib import Path

from iiwa_sim import Iiwa, Simulator

DOWN = (3.14159265, 0, 3.14159265)
X, Y, RIM, BOTTOM, RADIUS = 607, -4, 260, 200, 9.5  # mm: assumed place; the hole is at 600 0
ON_RIM = RIM + RADIUS
PITCH, STEP = 2, 1  # mm


def spring_to(robot: Iiwa, x_mm: float, y_mm: float, z_mm: float) -> tuple[float, float, float]:
    """Pull the peg to a place by a spring of 2000 N/m, and return where it rests (mm)."""
    robot.linstiff_move((x_mm, y_mm, z_mm, *DOWN), speed=0.1, stiffness=2000, force=(0, 0, 0, 0, 0, 0))
    robot.wait_until_stopped(timeout_s=60)
    return robot.get_tool_frame()[:3]


def main() -> None:
    cell = Path(__file__).with_name("peg.toml")
    with Simulator(cell=cell, clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        robot.ptp_move((X, Y, ON_RIM + 10, *DOWN), speed=0.5, blending=0)
        angle, tries, z = 0.0, 0, ON_RIM
        while z > ON_RIM - 3:
            radius, tries = PITCH * angle / tau, tries + 1
            x, y, z = spring_to(robot, X + radius * cos(angle), Y + radius * sin(angle), ON_RIM - 4)
            angle += STEP / max(radius, STEP)
        print(f"sinks in at {x:.1f} {y:.1f} mm, after {tries} places")
        print("at the bottom: {2:.1f} mm".format(*spring_to(robot, x, y, BOTTOM)))


if __name__ == "__main__":
    main()
