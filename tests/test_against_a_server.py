"""`iiwa-sim --transcript`, `replay` and `check` as processes."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S
from tests.processes import refused

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a subcommand in this process; return exit code, stdout and stderr."""

    def run(*arguments: str | Path) -> tuple[int, str, str]:
        return main([str(each) for each in arguments]), *capsys.readouterr()

    return run


@pytest.mark.requirement("FRA004")
def test_a_session_is_recorded_and_played(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    with Simulator(clock="fast", transcript=path) as simulator, Iiwa("127.0.0.1", simulator.port) as robot:
        robot.joint_move((0, 0.5, 0, -1, 0, 1.5, 0.1), [0.5] * 7)
        robot.wait_until_stopped(DEADLINE_S)
        robot.get_tool_frame()
        with pytest.raises(CommandError):
            robot.lin_move((2000, 0, 0, 0, 0, 0), 0.5, 0)
        robot.bye()
    text = path.read_text()
    assert text.startswith("# LBR iiwa 7 R800, recorded by iiwa-sim\n")
    assert " client1< error\n" in text
    assert text.endswith(" client1 leaves\n")
    # How often it was polled is up to the machine: that is made one wait.
    lines = [line for line in text.splitlines() if not line.endswith(("< moving", "> get status"))]
    path.write_text("\n".join("client1 wait stopped" if "< stopped" in line else line for line in lines))
    with Simulator(clock="fast") as another:
        server = f"127.0.0.1:{another.port}"
        code, output, faults = run("replay", path, server)
        assert (code, faults) == (0, "")
        assert output.startswith("0 deviations in ")
        path.write_text("> get mode\n< smart\n> hello\n< hello\n")
        assert run("replay", path, server) == (
            1,
            f"{path}:2: 'get mode': expected 'smart', got 'unknown'\n1 deviation in 4 lines\n",
            "",
        )


def test_an_unplayable_transcript_ends_with_one_line(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    path.write_text("> hello\n")
    assert run("replay", path, "127.0.0.1:1") == (
        2,
        "",
        f"iiwa-sim: {path}:1: expected a reply to each line, `<?` for any\n",
    )
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = f"127.0.0.1:{listener.getsockname()[1]}"
    path.write_text("> hello\n< hello\n")
    assert run("replay", path, server) == (
        2,
        "",
        f"iiwa-sim: cannot connect to {server}: Connection refused\n",
    )


@pytest.mark.parametrize(
    "text", ["", "\n# session\n", "protocol krc4\n", "[0.1 0.1] client1 connects\n[0.2 0.2] client1 leaves\n"]
)
def test_a_transcript_without_commands_does_not_pass(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "session.txt"
    path.write_text(text)
    with Simulator() as simulator:
        assert main(["replay", str(path), f"127.0.0.1:{simulator.port}"]) == 2
    assert capsys.readouterr() == (
        "",
        f"iiwa-sim: {path}: expected a line `> command` at least\n",
    )


def test_check_reports_on_the_simulator(capsys: pytest.CaptureFixture[str]) -> None:
    with Simulator() as simulator:
        assert main(["check", f"127.0.0.1:{simulator.port}"]) == 0
    output = capsys.readouterr().out
    assert (
        "\nas iiwa-sim      a second client (the original: waits until the first has gone; iiwa-sim" in output
    )
    assert "\nnot tried        the dialogue interrupted.txt: --allow-motion tries it\n" in output
    assert ", 0 DEVIATION, " in output


def test_wrong_ports() -> None:
    for words in (("check", "host:1,2"), ("replay", "file", "host:1,"), ("replay", "file", "host:1,65536")):
        assert f"'{words[-1]}' is not HOST:PORT" in refused(*words)
