"""An installed iiwa-sim, from its first line to its last: `python smoke.py PATH-OF-IIWA-SIM`."""

import contextlib
import importlib.util
import signal
import subprocess
import sys
import time

from iiwa_sim.client import Iiwa

TARGET = (0.3, 0.6, 0.0, -1.2, 0.1, 1.4, 0.2)


def main(program: str) -> None:
    for name in ("protocol", "robots"):
        assert importlib.util.find_spec(name) is None, f"the wheel installs a top-level {name}"

    with subprocess.Popen([program, "--port", "0"], stdout=subprocess.PIPE, text=True) as simulator:
        try:
            assert simulator.stdout is not None
            said, _, address = simulator.stdout.readline().rstrip("\n").partition("listening on ")
            assert said == "", said
            assert address, "it ended before it listened"
            host, _, port = address.rpartition(":")
            with contextlib.closing(Iiwa(host, int(port))) as robot:
                robot.hello()
                robot.joint_move(TARGET, [0.5] * 7)
                assert robot.get_status() == "moving"
                robot.wait_until_stopped(timeout_s=30)
                arrived = robot.get_joint_position()
                assert all(abs(a - b) < 1e-6 for a, b in zip(arrived, TARGET, strict=True)), arrived
                robot.bye()
            asked = time.monotonic()
            simulator.send_signal(signal.SIGTERM)
            code = simulator.wait(timeout=10)
            assert code == 0, f"exit code {code}"
        except BaseException:
            simulator.kill()
            raise
    print(f"smoke: hello, a move, bye and SIGTERM: all well, and gone in {time.monotonic() - asked:.2f} s")


if __name__ == "__main__":
    main(sys.argv[1])
