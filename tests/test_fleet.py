"""Several robots in one process: ports, names, options of each, and that none notices the others."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

from tests.processes import IIWA_SIM, next_line, refused, robots
from tests.talking import DEADLINE_S, Client


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
        protocol = "krc4"
        port = 0
        [robot.both]
        protocol = ["iiwa", "krc4"]
        strict = true
        port = [31000, 31001]
        servo_timeout = 1.5
        record = "both.mcap"
        """
    )
    found = robots("--fleet", str(file), "--clock", "fast", "--exclusive", "--record", "run.mcap")
    assert list(found) == ["welder", "painter", "both"]
    welder, painter, both = found.values()
    assert (welder.cell, welder.port) == (str(tmp_path / "cells/welder.toml"), (30000,))
    assert (painter.robot, painter.port) == ("kr_6_r900_sixx", (0,))
    assert [each.clock for each in found.values()] == ["10x", "fast", "fast"]
    assert [each.strict for each in found.values()] == [False, False, True]
    assert all(each.exclusive for each in found.values())
    assert (both.port, both.servo_timeout_s) == ((31000, 31001), 1.5)
    assert [each.record for each in (welder, painter)] == ["run-welder.mcap", "run-painter.mcap"]
    assert both.record == str(tmp_path / "both.mcap")


WRONG = {
    "": "expected at least one robot, as [robot.NAME]",
    "[robot]": "expected at least one robot",
    "[robot.'a b']": "robot.a b: expected a table and a name of letters, digits",
    "rate = 500\n[robot.one]": "rate: expected only tables [robot.NAME]",
    "[robot.one]\nprot = 1": "robot.one.prot: no such option, did you mean port?",
    "[robot.one]\nlog_level = 'debug'": "robot.one.log_level: no such option",
    "[robot.one]\nport = 65536": "robot.one.port = 65536: expected a whole number from 0 to 65535",
    "[robot.one]\nrate = '500'": "robot.one.rate = '500': expected a whole number",
    "[robot.one]\ncell = 'a.toml'\nrobot = 'b'": "robot.one: --robot: expected no CELL.toml with it",
    "[robot.one]\nros2 = true\n[robot.two]\nros2 = true": "--ros-namespace: expected a different one",
    "[robot.one": "expected a readable TOML file",
}


def test_what_is_wrong_in_a_file_is_one_line(tmp_path: Path) -> None:
    file = tmp_path / "fleet.toml"
    for text, told in WRONG.items():
        file.write_text(text)
        line = refused("--fleet", file)
        assert line.startswith(f"iiwa-sim: {file}: {told}"), line
