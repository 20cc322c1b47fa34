"""9. Two robots: one brings a part, the other waits for it.

Run `python examples/09_two_robots.py`. `iiwa-sim --count 20` runs many robots in one program.
"""

from contextlib import ExitStack

from iiwa_sim import Iiwa, Simulator

ABOVE = (450, 0, 560, 0, -1.57079, 0)
HANDOVER = (450, 150, 520, 0, -1.57079, 0)
READY, TAKEN = 1, 2  # digital outputs


def main() -> None:
    with ExitStack() as cell:
        simulators = [cell.enter_context(Simulator(name, clock="fast")) for name in ROBOTS]
        left, right = (cell.enter_context(Iiwa(each.host, each.port)) for each in simulators)
        left.lin_move(HANDOVER, speed=0.5, blending=0)
        left.wait_until_stopped(timeout_s=30)
        left.set_output(READY, value=True)

        assert left.get_output(READY)  # in a real cell this is wired to an input of the other robot
        right.ptp_move(HANDOVER, speed=0.3, blending=0)
        right.wait_until_stopped(timeout_s=30)
        right.set_output(TAKEN, value=True)
        left.lin_move(ABOVE, speed=0.5, blending=0)
        left.wait_until_stopped(timeout_s=30)
        print("handed over at", *(f"{mm:.0f}" for mm in right.get_tool_frame()[:3]))


ROBOTS = ("lbr_iiwa_7_r800", "lbr_iiwa_14_r820")

if __name__ == "__main__":
    main()
