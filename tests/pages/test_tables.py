"""Pages that are written from tables: nothing of the tables is left out."""

from __future__ import annotations

import iiwa_sim
from iiwa_sim.cli.names import SUBCOMMANDS
from iiwa_sim.cli.server_options import server_parser
from iiwa_sim.dialect.krc4.table import load_krc4_table
from iiwa_sim.dialect.wire.error_codes import load_error_codes
from iiwa_sim.dialect.wire.table_file import load_table
from iiwa_sim.remembered import Exchange
from tools.pages import commands, dialogues, refusals, tables
from tools.pages.dialogues import Turn
from tools.pages.refusals import Refusal


def test_the_page_of_errors_has_them_all() -> None:
    page = tables.errors()
    for code, row in load_error_codes().items():
        assert f"\n## {code}\n" in page
        assert row.remedy in page


def test_the_page_of_options_has_them_all_with_their_variables() -> None:
    page = tables.options()
    for action in server_parser().options:
        for spelling in action.option_strings:
            assert f"<code>{spelling}" in page or spelling in ("-h", "--help")
    assert "<code>IIWA_SIM_SERVO_TIMEOUT</code>" in page
    assert "\\|" not in page
    for name in SUBCOMMANDS:
        assert f"\n## iiwa-sim {name}\n" in page


def test_the_page_of_python_has_all_that_is_offered() -> None:
    listed = [name for names in tables.API.values() for name in names]
    assert sorted(listed) == sorted(iiwa_sim.__all__)


def test_a_command_has_its_usage_dialogue_refusals_and_requirements() -> None:
    said = [
        Exchange("driver", "hello", "hello", "hello"),
        Exchange("driver", "get input", "get input : 17", "error"),
        Exchange("driver", "get error", "get error", "1 no input 17: there are inputs 1 to 16"),
        Exchange("driver", "get input", "get input : 1", "0"),
        Exchange("driver", "get input", "get input : 1", "0"),
    ]
    asked = [
        Refusal(1, "", "get input : 18", "1 no input 18: there are inputs 1 to 16"),
        Refusal(3040, "", "get input", "3040 get input takes n: 1 value, got 0"),
        Refusal(3030, "the emergency stop is pressed", "get input : 1", "3030 emergency stop"),
    ]
    page = commands._command(load_table("iiwa").commands["get input"], [dialogues.turns(said)], asked)
    assert "```\nget input : n\n```" in page
    assert "An extension" in page
    assert "> get input : 1\n< 0    (2 times)" in page
    assert [line for line in page.splitlines() if "errors.md" in line] == [
        "|  | `get input : 17` | [1](../errors.md#1) no input 17: there are inputs 1 to 16 |",
        "| the emergency stop is pressed | `get input : 1` | [3030](../errors.md#3030) emergency stop |",
        "|  | `get input` | [3040](../errors.md#3040) get input takes n: 1 value, got 0 |",
    ]
    assert "- FRC023: " in page


def test_refusals_are_those_of_a_robot_that_was_asked() -> None:
    table = load_table("iiwa").commands
    with refusals.asker() as robot:
        asked = ("linr move", "direct joint move", "get status", "bye")
        found = {name: robot.refusals(refusals.lines(table[name])) for name in asked}
    codes = {name: {each.code for each in told} for name, told in found.items()}
    assert codes["linr move"] >= {3010, 3021, 3022, 3023, 3030, 3040, 3060}
    assert codes["direct joint move"] >= {3010, 3020, 3023, 3030, 3040, 3060}
    assert codes["get status"] == codes["bye"] == set()
    assert set().union(*codes.values()) <= set(load_error_codes())
    reasons = [each.told for each in found["linr move"]]
    assert len(reasons) == len(set(reasons))
    assert any("gravity hold" in each for each in reasons)


def test_refusals_of_messages_are_those_of_a_robot_that_was_asked() -> None:
    table = {each.tag: each for each in load_krc4_table().commands.values()}
    with refusals.krc4_asker() as robot:
        found = {tag: robot.refusals(refusals.messages(table[tag])) for tag in ("LIN", "PTA", "SIO", "FIN")}
    codes = {tag: {each.code for each in told} for tag, told in found.items()}
    assert codes["LIN"] >= {3010, 3021, 3030, 3060}
    assert codes["PTA"] == {3010, 3023, 3030, 3060}
    assert codes["SIO"] == {1, 2, 3040}
    assert codes["FIN"] == set()


def test_a_dialogue_begins_with_what_was_said_before() -> None:
    said = [Turn("hello", "hello", "hello"), Turn("stop", "stop", "error"), Turn("stop", "stop", "done")]
    assert dialogues.example([said], "stop") == said[1:]
    assert dialogues.example([said[:2]], "stop") == said[:2]
    assert dialogues.text(said[:1]) == "> hello\n< hello"
