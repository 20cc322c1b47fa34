"""5. Errors: a rejected move, an emergency stop, and the way out of the error state.

Run `python examples/05_errors.py`. protocol/errors.toml explains all error codes.
"""

from iiwa_sim import CommandError, Iiwa, Simulator

FAR = (2000, 0, 520, 0, -1.57079, 0)
LEFT = (450, 200, 520, 0, -1.57079, 0)


def main() -> None:
    with Simulator(clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        try:
            robot.lin_move(FAR, speed=0.5, blending=0)
        except CommandError:  # nothing has changed: the robot takes the next move
            code, reason = robot.get_error()
            print(f"refused: {code} {reason}")
            print(robot.help(str(code)))

        robot.lin_move(LEFT, speed=0.5, blending=0)
        simulator.backdoor.emergency_stop()  # as somebody at the cell would
        robot.wait_until_stopped(timeout_s=30)
        print("stopped:", *robot.get_error())

        simulator.backdoor.emergency_stop(pressed=False)
        robot.reset_error()  # until then every move is rejected
        robot.lin_move(LEFT, speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=30)
        print(f"there: y = {robot.get_tool_frame().y:.1f} mm")


if __name__ == "__main__":
    main()
