"""2. The Python client: `Iiwa` has a method for each command.

Run `python examples/02_client.py`. The robot runs in this program, as fast as possible. The same client works
with a real robot: `Iiwa("172.31.1.147", 30000)`.
"""

from iiwa_sim import Iiwa, Simulator


def main() -> None:
    with Simulator(clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        start = robot.get_tool_frame()
        print(f"start  y = {start.y:.1f} mm")

        robot.lin_move(start._replace(y=start.y + 100), speed=0.5, blending=0)  # accepted, not arrived
        robot.wait_until_stopped(timeout_s=30)
        print(f"there  y = {robot.get_tool_frame().y:.1f} mm")

        joints = robot.get_joint_position()
        robot.joint_move([*joints[:6], joints[6] + 0.5], [0.3] * 7)  # rad; speeds relative to the limits
        robot.wait_until_stopped(timeout_s=30)
        print(f"turned A7 = {robot.get_joint_position()[6]:.2f} rad")


if __name__ == "__main__":
    main()
