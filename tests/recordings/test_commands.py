"""`iiwa-sim plot` and `show` with recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from iiwa_sim.cli import main
from iiwa_sim.client import CommandError, Iiwa, Krc4
from iiwa_sim.plot.motion import Motion, motion_in
from iiwa_sim.recordings.read import Recording
from iiwa_sim.simulator import Simulator
from tests.recordings.recorded import FAR, contents

SPEEDS = [1.0] * 7
DOWN = (3.14159265359, 0, 3.14159265359)
TABLE = Path(__file__).parents[2] / "examples" / "table.toml"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two moves, and of a line that is refused."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    with (
        Simulator(clock="stepped", record=path) as simulator,
        Iiwa(simulator.host, simulator.port) as driver,
    ):
        driver.hello()
        driver.joint_move(FAR, SPEEDS)
        driver.joint_move([0, 0.5, 0, -1, 0, 1.5, 0.2], SPEEDS)
        simulator.run_until_stopped()
        driver.get_joint_position()
        with pytest.raises(CommandError):
            driver.lin_move((2000, 0, 0, 0, 0, 0), 0.5, 0)
    return path


def run_command(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> tuple[int, str, str]:
    code = main([str(each) for each in arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_plot_draws_a_recording(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The code is that for files of commands; the recording may have any name."""
    (named := tmp_path / "run.txt").hardlink_to(run)
    drawn: list[Motion] = []
    stand_in = SimpleNamespace(picture=lambda motion, _, kind: drawn.append(motion) or kind.encode())
    monkeypatch.setitem(sys.modules, "iiwa_sim.plot.draw", stand_in)
    assert main(["plot", str(named), "-o", str(tmp_path / "run.png")]) == 0
    assert (tmp_path / "run.png").read_bytes() == b"png"
    (motion,) = drawn
    states = contents(run, "/state")
    assert [list(each.joint_position) for each in motion.states] == [
        each["joint_position"] for each in states
    ]
    assert motion.description.name == "LBR iiwa 7 R800"
    assert [move.name for move in motion.moves] == ["JOINT 1"] * 2
    ends = [event["time_s"] for event in contents(run, "/events") if event["kind"] == "move ends"]
    assert [move.end_s for move in motion.moves] == pytest.approx(ends)
    assert motion.moves[1].goal_mm == pytest.approx(motion.states[-1].tool_frame[:3], abs=1e-3)


def test_plot_names_moves_by_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with (
        Simulator(cell=TABLE, protocol=["iiwa", "krc4"], clock="stepped", record=path) as simulator,
        Iiwa(simulator.host, simulator.ports["iiwa"]) as driver,
        Krc4(simulator.host, simulator.ports["krc4"], axes=7) as plc,
    ):
        driver.lin_move((600, 0, 420, *DOWN), 0.5, 20)
        driver.lin_move((600, 40, 420, *DOWN), 0.25, 0)
        plc.pta((0, 30, 0, -60, 0, 90, 10))
        simulator.run_until_stopped()
    named = [(move.name, move.blending_mm) for move in motion_in(Recording(path)).moves]
    assert named[:2] == [("LIN 0.5 r20", 20.0), ("LIN 0.25", 0.0)]
    assert named[2][0].startswith("Cmd I0=1 I1=25")


@pytest.mark.parametrize("command", [("plot", "{}", "-o", "a.png"), ("show", "{}")])
@pytest.mark.parametrize("content", [bytes([0x89]) + b"MCAP0\r\n" + b"\xff" * 100, None])
def test_rubbish_ends_in_one_line(
    command: tuple[str, ...], content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.mcap"
    if content is not None:
        path.write_bytes(content)
    code, out, err = run_command(capsys, *(word.format(path) for word in command))
    assert (code, out) == (2, "")
    assert err.startswith(f"iiwa-sim: {path}: ")
    assert err.count("\n") == 1
