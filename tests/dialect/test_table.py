import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.dialect.lines import OVERLONG
from iiwa_sim.dialect.table import (
    ERROR,
    UNKNOWN_COMMAND,
    Refusal,
    Request,
    TableError,
    load_table,
    read_table,
)

TABLE = load_table("iiwa")

blanks = st.text(" \t", max_size=3)
commands = st.sampled_from(list(TABLE.commands.values()))
parameterless = commands.filter(lambda command: not command.parameters and not command.phrase)
taking_numbers = commands.filter(lambda command: command.parameters)
numbers = st.floats(allow_nan=False, allow_infinity=False, width=32)


@st.composite
def mangled(draw: st.DrawFn, words: list[str]) -> str:
    """The same words with other letter case, blanks and tabs."""
    spelled = []
    for word in words:
        upper = draw(st.lists(st.booleans(), min_size=len(word), max_size=len(word)))
        spelled.append("".join(c.upper() if up else c for c, up in zip(word, upper, strict=True)))
    line = draw(blanks)
    for word in spelled:
        line += word + draw(st.text(" \t", min_size=1, max_size=3))
    return line.rstrip(" \t") + draw(blanks)


def parse(line: str) -> Request | Refusal:
    return TABLE.parse(line.encode())


def refusal(line: str) -> str:
    """The reply to a line that must be refused, with a reason."""
    refused = parse(line)
    assert isinstance(refused, Refusal)
    assert refused.reason
    assert "\n" not in refused.reason
    return refused.reply


@given(st.data(), commands)
def test_letter_case_and_blanks_do_not_matter(data, command):
    values = tuple(data.draw(st.tuples(*[numbers] * len(command.parameters))))
    line = data.draw(mangled(command.name.split()))
    if values or data.draw(st.booleans()):
        line += ":" + data.draw(mangled([repr(value) for value in values]))
    assert parse(line) == Request(command, values, "")


@given(parameterless, st.text(st.characters(codec="ascii", exclude_characters=":\r\n"), max_size=20))
def test_parameters_behind_a_command_that_takes_none_are_ignored(command, rest):
    assert parse(f"{command.name} :{rest}") == Request(command, (), "")


@given(taking_numbers, st.integers(0, 20))
def test_a_wrong_number_of_parameters_is_an_error(command, count):
    line = f"{command.name} : {' '.join(['0.5'] * count)}"
    if count == len(command.parameters):
        assert parse(line) == Request(command, (0.5,) * count, "")
    else:
        assert refusal(line) == ERROR


@given(
    st.data(),
    taking_numbers,
    st.sampled_from(["nan", "inf", "-Infinity", "1e999", "1,5", "1_0", "0x1", "x", "--1"]),
)
def test_a_parameter_that_is_no_finite_number_is_an_error(data, command, word):
    words = ["0.5"] * len(command.parameters)
    words[data.draw(st.integers(0, len(words) - 1))] = word
    assert refusal(f"{command.name} : {' '.join(words)}") == ERROR


@given(taking_numbers)
def test_a_move_without_parameters_is_an_error(command):
    assert refusal(command.name) == ERROR
    assert refusal(command.name + " :") == ERROR


@pytest.mark.parametrize(
    "line",
    ["", " ", "\t \t", ":", " : ", "::", "get status::", "get status : :", "lin move : 1 : 2", "getstatus",
     "get", "get  status x", "lin move 1 2", "hello robot", "get\x0bstatus", "g\u00eat status", "\u017ftop"],
)  # fmt: skip
def test_what_names_no_command_is_unknown(line):
    assert refusal(line) == UNKNOWN_COMMAND


@given(st.binary())
def test_any_bytes_are_a_request_or_refused(line):
    answer = TABLE.parse(line)
    assert isinstance(answer, Request | Refusal)
    if isinstance(answer, Request):
        assert len(answer.values) == len(answer.command.parameters)
        assert all(math.isfinite(value) for value in answer.values)


def test_a_line_that_was_too_long_is_an_error():
    refused = TABLE.parse(OVERLONG)
    assert isinstance(refused, Refusal)
    assert refused.reply == ERROR


def test_words_for_a_command_that_takes_words():
    assert parse("help :  LIN \t move ") == Request(TABLE.commands["help"], (), "lin move")
    assert parse("help") == Request(TABLE.commands["help"], (), "")


def test_what_is_remembered_of_lines_is_bounded():
    table = read_table(SMALL.encode(), "small.toml")
    for number in range(5000):
        table.parse(b"wave : %d" % number)
        table.parse(b"wave" + b" " * number + b": 1")
        assert sum(len(kept) for kept in (table._lines, table._by_spelling)) <= 2048
    assert table.parse(OVERLONG).reply == ERROR


SMALL = """
title = "a small protocol"
source = "this test"
[value]
n = { unit = "1", above = 0, maximum = 4, meaning = "how often" }
[command.nod]
summary = "Nods n times."
mode = "any"
requirements = []
parameters = "n"
reply.values = "n"
[command.wave]
summary = "Waves."
mode = "any"
requirements = []
reply.words = ["done"]
"""


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('parameters = "n"', 'parameters = "n m"', "command.nod.parameters: m has no row"),
        ('reply.values = "n"', 'reply.values = "m"', "command.nod.reply.values: m has no row"),
        ('reply.values = "n"', 'reply.values = ""', "command.nod.reply: expected one of"),
        (
            'reply.values = "n"',
            'reply.values = "n"\nreply.prose = true',
            "command.nod.reply: expected one of",
        ),
        ('parameters = "n"', 'parameters = "n"\nphrase = "word"', "command.nod: expected either"),
        ("[command.nod]", "[command.Nod]", "command.Nod: expected a name in lower case"),
        ('mode = "any"', "mode = 3", "Expected `str`, got `int`"),
        ('mode = "any"', 'mood = "any"', "unknown field `mood`"),
        ("[value]", "[value", "small.toml"),
    ],
)
def test_a_fault_in_a_table_is_told_in_one_line(old, new, told):
    assert old in SMALL
    with pytest.raises(TableError) as raised:
        read_table(SMALL.replace(old, new, 1).encode(), "small.toml")
    assert "small.toml: " in str(raised.value)
    assert told in str(raised.value)
    assert "\n" not in str(raised.value)


def test_usage_tells_units_and_ranges():
    assert read_table(SMALL.encode(), "small.toml").commands["nod"].usage() == "nod : n[0 < n <= 4] -> n[1]"
    assert "x[mm]" in TABLE.commands["lin move"].usage()
    assert "blending[mm, 0 <= blending]" in TABLE.commands["lin move"].usage()
    assert TABLE.commands["get status"].usage() == "get status -> moving / stopped"
