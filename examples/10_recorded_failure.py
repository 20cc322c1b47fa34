"""10. A recorded failure: a transcript is a test without any code.

`python examples/10_recorded_failure.py` records a session with a rejected move and replays it. The same robot
gives the same replies; a longer arm reaches the target. In a shell: `iiwa-sim --transcript session.txt`, then
`iiwa-sim replay session.txt HOST:PORT`.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from iiwa_sim import CommandError, Iiwa, Simulator
from iiwa_sim.transcript.lines import read_file
from iiwa_sim.transcript.replay import replay


def main() -> None:
    with TemporaryDirectory() as folder:
        session = Path(folder) / "session.txt"
        simulator = Simulator(clock="fast", transcript=session)
        with simulator, Iiwa(simulator.host, simulator.port) as robot:
            try:
                robot.lin_move((585, 0, 520, 0, -1.57079, 0), speed=0.5, blending=0)
            except CommandError as rejected:  # the client has asked `get error`
                print("refused:", rejected.reason)

        for name in ("lbr_iiwa_7_r800", "lbr_iiwa_14_r820"):
            with Simulator(name, clock="fast") as simulator:
                found = list(replay(read_file(session), simulator.host, simulator.port))
                print(f"{name}: {len(found)} answered otherwise", *found)


if __name__ == "__main__":
    main()
