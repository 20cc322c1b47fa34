"""The process that writes recordings: what ends it, or the robot's, and what becomes of the file."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.recordings.read import Recorded
from tests.processes import Process, ended, killed_unless_done, refused, running
from tests.recordings.recorded import FAR, Robot, is_whole, states_by_now
from tests.talking import DEADLINE_S, wait_until

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="it is looked for in /proc")

# Runs the program with files that cannot grow beyond 200 kB, as on a disk that is nearly full.
LITTLE_ROOM = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
from iiwa_sim.cli import main
sys.exit(main(sys.argv[1:]))
"""


def writer_of(process: int) -> int:
    """The number of the process that writes what another one records, which is its last argument."""
    (found,) = (
        int(folder.name)
        for folder in Path("/proc").glob("[0-9]*")
        if b"iiwa_sim.recordings" in (words := command_of(folder)) and words[-1] == str(process).encode()
    )
    return found


def command_of(folder: Path) -> list[bytes]:
    """The command of a process; empty once it has ended, also where nobody has asked for its exit code."""
    try:
        return (folder / "cmdline").read_bytes().rstrip(b"\0").split(b"\0")
    except OSError:  # gone
        return [b""]


def wait_for_the_end_of(process: int) -> None:
    wait_until(lambda: command_of(Path("/proc", str(process))) == [b""])


def wait_for_states(path: Path, ticks: int) -> int:
    """Until a file that is being written has them; gives the last tick."""

    def newest() -> int:
        return max((state.tick for state in states_by_now(path)), default=0)

    wait_until(lambda: newest() >= ticks)
    return newest()


def check_whole(path: Path) -> int:
    """Each tick is there, and the end; gives the last tick."""
    recorded = Recorded(path)
    ticks = [state.tick for state in recorded.states()]
    assert not recorded.cut
    assert ticks == list(range(len(ticks))) != []
    return ticks[-1]


def test_the_robot_goes_on_where_the_disk_is_full(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    program = (sys.executable, "-c", LITTLE_ROOM)
    with running("--record", str(path), "--clock", "fast", program=program) as robot:
        assert robot.process.stderr is not None
        with Iiwa("127.0.0.1", robot.port) as driver:
            driver.joint_move(FAR, [0.2] * 7)
            driver.wait_until_stopped(DEADLINE_S)
            with killed_unless_done(robot.process):
                line = robot.process.stderr.readline()
            driver.joint_move([0, 0.5, 0, -1, 0, 1.5, 0], [1] * 7)
            driver.wait_until_stopped(DEADLINE_S)
        code, said = robot.ends(signal.SIGTERM)
    assert line.endswith(f"error {path}: the recording ends here: File too large\n")
    assert (code, said) == (0, "")
    recorded = Recorded(path)
    ticks = [state.tick for state in recorded.states()]
    assert recorded.cut
    assert ticks == list(range(len(ticks))) != []


def test_a_full_disk_from_the_start_is_told_at_once() -> None:
    told = refused("--port", "0", "--record", "/dev/full")
    assert told == "iiwa-sim: /dev/full: cannot be written: No space left on device\n"


@LINUX
def test_a_robot_that_is_killed_leaves_a_whole_file(tmp_path: Path) -> None:
    """It lacks what was not handed over, a twentieth of a second, and says that it was left."""
    path = tmp_path / "run.mcap"
    with running("--record", str(path)) as robot:
        writer = writer_of(robot.process.pid)
        seen = wait_for_states(path, 200)
        robot.process.send_signal(signal.SIGKILL)
        robot.process.wait(DEADLINE_S)
    wait_until(lambda: is_whole(path))
    assert check_whole(path) >= seen
    assert b"and the recording with it" in path.read_bytes()
    wait_for_the_end_of(writer)


@pytest.mark.slow
@LINUX
def test_what_ends_a_group_of_processes_leaves_a_whole_file(tmp_path: Path) -> None:
    """Such as a CI job that is cancelled, or Ctrl-C; and what is meant for the one that writes, too."""
    path = tmp_path / "run.mcap"
    command = (sys.executable, "-m", "iiwa_sim", "--port", "0", "--record", str(path))
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            robot = Process(process)
            assert robot.line()
            writer = writer_of(process.pid)
            seen = wait_for_states(path, 100)
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                os.kill(writer, number)
            os.killpg(process.pid, signal.SIGTERM)
            _, said = process.communicate(timeout=DEADLINE_S)
        finally:
            process.kill()
    assert (process.returncode, said) == (0, "")
    assert check_whole(path) >= seen
    wait_for_the_end_of(writer)


def test_the_robot_goes_on_where_the_process_that_writes_is_killed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    robot = Robot(first)
    robot.step(200)
    wait_until(lambda: len(states_by_now(first)) > 100)
    os.kill(robot.recorder.writing_process, signal.SIGKILL)
    robot.recorder._out._listener.join(DEADLINE_S)
    robot.step(200)
    robot.recorder.stop()
    assert not robot.recorder.finish()
    assert [each.getMessage() for each in caplog.records if str(first) in each.getMessage()] == [
        f"{first}: the recording ends here: the process that writes it was killed by signal 9"
    ]
    assert not is_whole(first)
    again = Robot(second, controller=robot.controller)
    assert again.recorder.writing_process != robot.recorder.writing_process
    again.step(100)
    again.end()
    assert len(list(Recorded(second).states())) == 101


def test_one_process_writes_all_recordings_of_a_process(tmp_path: Path) -> None:
    robots = [Robot(tmp_path / f"{number}.mcap") for number in range(3)]
    assert len({robot.recorder.writing_process for robot in robots}) == 1
    for robot in robots:
        robot.step(10)
    for robot in robots:
        robot.end()
        assert check_whole(tmp_path / f"{robots.index(robot)}.mcap") == 10


@pytest.mark.slow
def test_the_program_that_records_is_not_run_again(tmp_path: Path) -> None:
    """It need not guard its main part, and its folder need not be free of names such as socket.py."""
    (tmp_path / "socket.py").write_text("raise RuntimeError('another one')")
    folder = tmp_path / "program"
    folder.mkdir()
    script = folder / "main.py"
    script.write_text(
        "from iiwa_sim import Simulator\n"
        "print('once')\n"
        "with Simulator(port=0, clock='stepped', record='run.mcap') as robot:\n"
        "    robot.advance(0.1)\n"
    )
    done = ended([sys.executable, script], cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "once\n", "")
    assert check_whole(tmp_path / "run.mcap") == 50


@pytest.mark.slow
def test_nothing_is_left_where_a_recording_is_never_closed(tmp_path: Path) -> None:
    script = (
        "from iiwa_sim import Simulator\n"
        f"robot = Simulator(port=0, clock='stepped', record={str(tmp_path / 'run.mcap')!r})\n"
        "robot.__enter__()\n"
        "robot.advance(0.1)\n"
    )
    done = ended([sys.executable, "-W", "error", "-c", script])
    assert (done.returncode, done.stdout) == (0, "")
    assert "recordings" not in done.stderr
    wait_until(lambda: is_whole(tmp_path / "run.mcap"))
    assert check_whole(tmp_path / "run.mcap") >= 25, "a twentieth of a second was not handed over yet"
