"""--help: what belongs together stands together, with examples that are taken."""

from __future__ import annotations

import shlex
from importlib import import_module

import pytest

from iiwa_sim.cli import main
from iiwa_sim.cli.names import SUBCOMMANDS, module_of, summaries
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.cli.server_options import server_parser

PARSERS: dict[str, Parser] = {
    "": server_parser(),
    **{name: import_module(module_of(name))._parser() for name in SUBCOMMANDS},
}


def helped(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as caught:
        main([*arguments, "--help"])
    assert caught.value.code == 0
    return capsys.readouterr().out


def test_options_stand_in_sections_and_commands_and_examples_below(
    capsys: pytest.CaptureFixture[str],
) -> None:
    told = helped([], capsys)
    titles = [line for line in told.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert titles[:3] == ["robots:", "connections:", "time:"]
    assert titles[-2:] == ["commands:", "examples:"]
    for name, summary in summaries().items():
        assert f"  {name} " in told
        assert summary in told
    assert len(PARSERS[""].examples) == 3
    for line in PARSERS[""].examples:
        assert f"\n  {line} " in told


@pytest.mark.parametrize("name", PARSERS)
def test_each_option_is_told_once(name: str) -> None:
    parser = PARSERS[name]
    told = [action for section in parser.sections() for action in section.actions]
    assert sorted(map(id, told)) == sorted(map(id, parser.options))


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_a_command_has_an_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "\nexamples:\n  iiwa-sim " in helped([name], capsys)


@pytest.mark.parametrize("name", PARSERS)
def test_an_example_is_taken(name: str) -> None:
    parser = PARSERS[name]
    for line in parser.examples:
        given = shlex.split(line.partition(">")[0].removeprefix(parser.prog))
        parser.parse_args(given)
