"""`iiwa-sim --transcript`, `replay` and `check` as processes."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.simulator import Simulator
from tests.check.original import Bare, Moving, serving
from tests.krc4_talking import Krc4Client
from tests.processes import refused
from tests.talking import DEADLINE_S

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a subcommand within this process; exit code, and what it said on stdout and stderr."""

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
    assert text.startswith("# LBR iiwa 7 R800, recorded by iiwa-sim ")
    assert " client1< error\n" in text
    assert text.endswith(" client1 leaves\n")
    # How often it was polled is up to the machine: that is made one wait.
    lines = [line for line in text.splitlines() if not line.endswith(("< moving", "> get status"))]
    path.write_text("\n".join("client1 wait stopped" if "< stopped" in line else line for line in lines))
    with Simulator(clock="fast") as another:
        server = f"127.0.0.1:{another.port}"
        code, said, faults = run("replay", path, server)
        assert (code, faults) == (0, "")
        assert said.startswith("0 deviations in ")
        path.write_text("> get mode\n< smart\n> hello\n< hello\n")
        assert run("replay", path, server) == (
            1,
            f"{path}:2: 'get mode': expected 'smart', got 'unknown'\n1 deviation in 4 lines\n",
            "",
        )


def test_what_cannot_be_played_ends_with_one_line(run: Run, tmp_path: Path) -> None:
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


@pytest.mark.requirement("FRA004")
def test_a_session_in_both_protocols_is_recorded_and_played(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "session.txt"

    protocols = ["krc4", "iiwa"]
    with (
        Simulator(protocol=protocols, clock="fast", transcript=path) as simulator,
        Iiwa("127.0.0.1", simulator.ports["iiwa"]) as robot,
    ):
        with Krc4Client(simulator.ports["krc4"]) as krc4:
            krc4.ask("PTA", 5.0, 30.0, 0.0, -60.0, 0.0, 90.0, 10.0)
            robot.wait_until_stopped(DEADLINE_S)
            krc4.ask("GOA")
            krc4.ask("PTP", 9999.0)
        robot.bye()
    text = path.read_text()
    assert "\nprotocol krc4,iiwa\n" in text
    assert " client1 connects in iiwa\n" in text
    lines = [line for line in text.splitlines() if not line.endswith(("< moving", "> get status"))]
    path.write_text("\n".join("client2 wait stopped" if "< stopped" in line else line for line in lines))
    with Simulator(protocol=protocols, clock="fast") as another:
        server = f"127.0.0.1:{another.ports['krc4']},{another.ports['iiwa']}"
        code, said, faults = run("replay", path, server)
        assert (code, faults) == (0, "")
        assert said.startswith("0 deviations in ")
        path.write_text("protocol krc4,iiwa\n> Cmd I0=1 I1=200 I2=99\n< Res I0=1 I1=200\n")
        deviation = "'Cmd I0=1 I1=200 I2=99': expected 'Res I0=1 I1=200', got 'Res I0=1 I1=-200 I2=1'"
        assert run("replay", path, server) == (1, f"{path}:3: {deviation}\n1 deviation in 2 lines\n", "")
        assert run("replay", path, f"127.0.0.1:{another.port}") == (
            2,
            "",
            f"iiwa-sim: {path}: 1 port, expected 2, one each for krc4, iiwa\n",
        )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("protocol krc4\n> Cmd I0\n<?\n", ":2: '> Cmd I0': 'I0': expected NAME=VALUE, such as I1=100"),
        ("protocol krc5\n", ":1: 'protocol krc5': expected iiwa or krc4, each at most once, a comma between"),
        (
            "> hello\n< hello\nplc connects in krc4\n",
            ":3: 'plc connects in krc4': expected one of the protocols",
        ),
    ],
)
def test_lines_that_are_none_end_with_one_line(
    text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "session.txt"
    path.write_text(text)
    assert main(["replay", str(path), "127.0.0.1:1"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"iiwa-sim: {path}{told}")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    "text", ["", "\n# session\n", "protocol krc4\n", "[0.1 0.1] client1 connects\n[0.2 0.2] client1 leaves\n"]
)
def test_a_recording_that_was_lost_does_not_pass(
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


def test_a_server_of_krc4_messages_is_not_checked(capsys: pytest.CaptureFixture[str]) -> None:
    with Simulator(protocol=["krc4"]) as simulator:
        assert main(["check", f"127.0.0.1:{simulator.port}"]) == 2
        told = f"127.0.0.1:{simulator.port} answers with KRC4 messages, expected the iiwa's protocol"
    assert capsys.readouterr() == ("", f"iiwa-sim: {told}\n")


def test_our_own_server_is_checked(capsys: pytest.CaptureFixture[str]) -> None:
    with Simulator() as simulator:
        assert main(["check", f"127.0.0.1:{simulator.port}"]) == 0
    said = capsys.readouterr().out
    assert "\nas iiwa-sim      a second client: is served at the same time" in said
    assert "\nnot tried        stop, on the way (--allow-motion tries it)\n" in said
    assert "\n0 deviations; " in said
    assert said.splitlines()[-1].startswith("sent: (blank) ")
    assert " move " not in said.splitlines()[-1]


def test_a_server_that_deviates(capsys: pytest.CaptureFixture[str]) -> None:
    with serving(Bare) as server:
        assert main(["check", f"127.0.0.1:{server.port}"]) == 1
    said = capsys.readouterr().out
    assert r"DEVIATION        any reply: hello was answered b'hello\n': a driver that compares with" in said
    assert "\n1 deviation; " in said


def test_a_server_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    with serving(Moving) as server:
        assert main(["check", f"127.0.0.1:{server.port}"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("iiwa-sim: the robot at 127.0.0.1:")
    assert err.count("\n") == 1


def test_ports_that_are_none() -> None:
    for words in (("check", "host:1,2"), ("replay", "file", "host:1,"), ("replay", "file", "host:1,65536")):
        assert f"'{words[-1]}' is not HOST:PORT" in refused(*words)
