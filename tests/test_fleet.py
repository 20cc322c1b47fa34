"""Several robots in one process: ports, names, options of each, and that none notices the others."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from iiwa_sim.cli import main, server_options
from iiwa_sim.cli.fleet import descriptors_of, robots_of
from iiwa_sim.recordings.read import Recorded
from tests.processes import IIWA_SIM, next_line
from tests.talking import DEADLINE_S, Client

COUNT = 4
JOINTS = ("0.3 0.6 0.1 -1.2 0.1 1.4 0.2", "-0.5 0.2 0.4 -1.6 -0.3 0.9 1.1", "0 0.5 0 -1.5 0 1.1 0")
ROUND = [
    *(f"joint move : {joints} " + " ".join(["0.6"] * 7) for joints in JOINTS),
    "lin move : 500 150 480 0 -1.57079 0 0.5 0",
    "lin move : 450 -100 520 0.2 -1.4 0.1 0.3 0",
]
SAMPLES = 3
HOUR_S = 3600.0


@contextlib.contextmanager
def fleet(*options: str) -> Iterator[tuple[subprocess.Popen[str], dict[str, dict[str, int]]]]:
    """A process, and by robot and port's name the ports."""
    with subprocess.Popen(
        [*IIWA_SIM, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            expected = len(robots(*options)) * sum(option.endswith("port") for option in options)
            ports: dict[str, dict[str, int]] = {}
            for _ in range(expected):
                line = next_line(process)
                found = re.fullmatch(r"(?:(\S+) )?(\w+) on 127\.0\.0\.1:(\d+)\n", line)
                assert found is not None, line
                ports.setdefault(found[1] or "", {})[found[2]] = int(found[3])
            yield process, ports
        finally:
            process.kill()


def robots(*options: str) -> list[str]:
    parser = server_options.server_parser()
    return [robot.name for robot in robots_of(parser, server_options.parsed(options, {}))]


async def driven(ports: dict[str, int], rounds: int, override: float) -> list[object]:
    """What one robot shows of a program: its states at rest, and on the way at fixed ticks of each move.

    Between the rounds it rests, for an hour altogether.
    """
    driver, bench = await Client.connect(ports["listening"]), await Client.connect(ports["backdoor"])
    seen: list[object] = []
    assert await driver.ask(f"set override : {override}") == "done"
    for number, line in enumerate(ROUND * rounds):
        if number % len(ROUND) == 0:
            assert await bench.ask(f"advance : {HOUR_S / rounds}") == "done"
            seen.append(await state(bench))
        assert await bench.ask("pause") == "done"
        assert await driver.ask(line) == "done"
        for _ in range(SAMPLES):
            assert await bench.ask("advance : 0.02") == "done"
            seen.append(await state(bench))
        assert await bench.ask("resume") == "done"
        await driver.until_stopped()
        assert await bench.ask("advance : 0.01") == "done"  # or the last tick of the move may show a velocity
        seen.append(await state(bench))
    await driver.leaves()
    await bench.leaves()
    return seen


async def state(bench: Client) -> object:
    """All of it but for what time it is."""
    seen = json.loads(await bench.ask("get state"))
    del seen["time_s"], seen["tick"]
    return seen


def test_robots_driven_at_once_move_as_one_alone_bit_for_bit() -> None:
    """For more than a simulated hour, of which the rest takes no time."""
    rounds, override = 1, 1.0
    options = ("--port", "0", "--backdoor-port", "0", "--clock", "fast")

    async def all_driven(ports: list[dict[str, int]]) -> list[list[object]]:
        return await asyncio.gather(*(driven(each, rounds, override) for each in ports))

    with fleet(*options) as (_, ports):
        (alone,) = asyncio.run(all_driven([ports[""]]))
    with fleet("--count", str(COUNT), *options) as (_, ports):
        assert list(ports) == [f"robot-{index}" for index in range(COUNT)]
        together = asyncio.run(all_driven(list(ports.values())))
    assert len(alone) == rounds * (len(ROUND) * (SAMPLES + 1) + 1)
    assert alone[0] != alone[1] != alone[2] != alone[SAMPLES]
    assert all(each == alone for each in together)


def test_one_log_tells_which_robot() -> None:
    with fleet("--count", "2", "--port", "0", "--log-level", "info", "--log-json") as (process, ports):

        async def said() -> None:
            for name in ("robot-1", "robot-0"):
                client = await Client.connect(ports[name]["listening"])
                assert await client.ask(f"nonsense {name}") == "unknown command"
                assert await client.ask("bye") == "bye"
                await client.leaves()

        asyncio.run(said())
        process.terminate()
        _, told = process.communicate(timeout=DEADLINE_S)
    lines = [json.loads(line) for line in told.splitlines()]
    refused = [(line["robot"], line["line"]) for line in lines if "code" in line]
    assert refused == [("robot-1", "nonsense robot-1"), ("robot-0", "nonsense robot-0")]
    assert {line["robot"] for line in lines if "session" in line} == {"robot-0", "robot-1"}
    assert process.returncode == 0


def test_ports_are_counted_up_from_those_that_are_named() -> None:
    options = ["--count", "3", "--dialect", "iiwa,krc4", "--port", "31000,32000", "--status-port", "33000"]
    options += ["--backdoor-port", "0", "--transcript", "said.txt", "--record", "runs/run.mcap"]
    parser = server_options.server_parser()
    found = [robot.options for robot in robots_of(parser, server_options.parsed(options, {}))]
    assert [each.port for each in found] == [[31000, 32000], [31001, 32001], [31002, 32002]]
    assert [each.status_port for each in found] == [33000, 33001, 33002]
    assert {each.backdoor_port for each in found} == {0}
    assert [str(each.transcript) for each in found] == [f"said-robot-{index}.txt" for index in range(3)]
    assert [str(each.record) for each in found] == [f"runs/run-robot-{index}.mcap" for index in range(3)]
    assert descriptors_of(robots_of(parser, server_options.parsed(options, {}))) == 3 * (1 + 4 + 2)


@pytest.mark.slow
def test_each_robot_has_a_recording_of_its_own(tmp_path: Path) -> None:
    options = ("--count", "2", "--port", "0", "--clock", "fast", "--record", str(tmp_path / "run.mcap"))
    with fleet(*options) as (process, ports):

        async def said() -> None:
            for name in ports:
                client = await Client.connect(ports[name]["listening"])
                assert await client.ask(f"nonsense {name}") == "unknown command"
                await client.leaves()

        asyncio.run(said())
        process.terminate()
        process.communicate(timeout=DEADLINE_S)
    for name in ("robot-0", "robot-1"):
        recorded = Recorded(tmp_path / f"run-{name}.mcap")
        texts = [spoken.text for spoken in recorded.dialogue()]
        assert texts[:3] == ["connected", f"nonsense {name}", "unknown command"]
        assert not recorded.cut


def test_a_file_names_robots_of_different_kinds(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "welder.toml").write_text('robot = "lbr_iiwa_14_r820"\n')
    file = tmp_path / "fleet.toml"
    file.write_text(
        """
        [robot.welder]
        cell = "cells/welder.toml"
        clock = "10x"
        [robot.painter]
        robot = "kr_6_r900_sixx"
        dialect = "krc4"
        port = 0
        [robot.both]
        dialect = ["iiwa", "krc4"]
        strict = true
        port = [31000, 31001]
        servo_timeout = 1.5
        record = "both.mcap"
        """
    )
    parser = server_options.server_parser()
    options = ["--fleet", str(file), "--clock", "fast", "--exclusive", "--record", "run.mcap"]
    given = server_options.parsed(options, {})
    welder, painter, both = robots_of(parser, given)
    assert [welder.name, painter.name, both.name] == ["welder", "painter", "both"]
    assert (welder.options.cell, welder.options.port) == (str(tmp_path / "cells/welder.toml"), [30000])
    assert (painter.options.robot, painter.options.port) == ("kr_6_r900_sixx", [0])
    assert [each.options.clock.name for each in (welder, painter, both)] == ["10x", "fast", "fast"]
    assert [each.options.strict for each in (welder, painter, both)] == [False, False, True]
    assert all(each.options.exclusive for each in (welder, painter, both))
    assert (both.options.port, both.options.servo_timeout) == ([31000, 31001], 1.5)
    assert [str(each.options.record) for each in (welder, painter)] == ["run-welder.mcap", "run-painter.mcap"]
    assert both.options.record == tmp_path / "both.mcap"


def test_the_example_serves_as_it_says() -> None:
    file = Path(__file__).parent.parent / "examples" / "fleet.toml"
    parser = server_options.server_parser()
    found = robots_of(parser, server_options.parsed(["--fleet", str(file)], {}))
    assert len(found) == 3
    assert len({robot.options.robot or robot.options.cell for robot in found}) == 3


TABLE = "[robot.one]\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "FILE: robot = (missing): "),
        ("[robot]\n", "FILE: robot = {}: "),
        ("[robot.'a b']\n", "FILE: robot.a b = 'a b': "),
        (TABLE + "prot = 1\n", "FILE: robot.one.prot = 1: "),
        (TABLE + "port = 65536\n", "FILE: robot.one.port: '65536' "),
        (TABLE + "cell = 'a.toml'\nrobot = 'b'\n", "FILE: robot.one: argument --robot: "),
        (TABLE + "port = 5\n[robot.two]\nport = 5\n", "FILE: --port of two overlaps --port of one: "),
        ("[robot.one", "FILE: expected valid TOML"),
    ],
)
def test_what_is_wrong_in_a_file_is_one_line(
    text: str, told: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text(text)
    assert main(["--fleet", str(file)]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("iiwa-sim: ")
    assert err.count("\n") == 1
    assert told.replace("FILE", str(file)) in err


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--count", "0"], "argument --count: '0' "),
        (["--count", "2", "--ros"], "argument --ros: expected one robot"),
        (["--count", "2", "--status-port", "30001"], "--port of robot-1 overlaps --status-port of robot-0: "),
        (["--count", "2", "--port", "65535"], "argument --port: robot number 1 would have 65536"),
    ],
)
def test_what_is_wrong_in_options_is_one_line(
    options: list[str], told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(options)
    assert caught.value.code == 2
    err = capfd.readouterr().err
    assert told in err
    assert err.count("\n") == 1
