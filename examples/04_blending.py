"""4. Blended moves: the gain of a blending radius.

`python examples/04_blending.py` drives a square twice: with a stop in each corner, and blended within 40 mm.
"""

from iiwa_sim import Iiwa, Simulator

CORNERS = ((450, 100), (450, -100), (550, -100), (550, 100))
"""x and y (mm)."""


def seconds(blending_mm: float) -> float:
    """Return the simulated time for the square (s)."""
    with Simulator(clock="stepped") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        for x, y in (*CORNERS, CORNERS[0]):
            robot.ptp_move((x, y, 520, 0, -1.57079, 0), speed=0.5, blending=blending_mm)
        return simulator.run_until_stopped()  # with this clock time passes only here


def main() -> None:
    stopping, passing = seconds(0), seconds(40)
    print(f"with a stop in each corner {stopping:.2f} s, passing them {passing:.2f} s")
    assert passing < stopping


if __name__ == "__main__":
    main()
