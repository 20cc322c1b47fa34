"""7. A lost reply: the driver connects again and repeats its query.

Run `python examples/07_lost_reply.py`. Other faults are Delay, Split, Garble, CloseBefore and Silence.
"""

from iiwa_sim import Drop, Iiwa, Simulator

TRIES = 10


def joints_despite_a_lost_reply(robot: Iiwa) -> tuple[float, ...]:
    """Return the joints; on the old connection a late reply would answer the next query."""
    for _ in range(TRIES):
        try:
            return robot.get_joint_position()
        except TimeoutError:
            print("no reply in time: connecting anew")
            robot.reconnect()
    raise TimeoutError(f"no reply in {TRIES} tries")


def main() -> None:
    with Simulator(clock="fast") as simulator, Iiwa(simulator.host, simulator.port, 1.0) as robot:
        simulator.backdoor.set_fault(Drop(), replies=1)
        print("joints", *joints_despite_a_lost_reply(robot))


if __name__ == "__main__":
    main()
