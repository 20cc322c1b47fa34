import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.table import ERROR, UNKNOWN_COMMAND, Quantity, Refusal, Request, load_table

TABLE = load_table("iiwa")

blanks = st.text(" \t", max_size=3)
commands = st.sampled_from(list(TABLE.commands.values()))
taking_numbers = commands.filter(lambda command: command.parameters)


def fitting(quantity: Quantity) -> str:
    """Return a number that the table allows, for every quantity of the kind the same."""
    return "1" if quantity.integer else "0.5"


@st.composite
def mangled(draw: st.DrawFn, words: list[str]) -> str:
    """Return the words of a command with other letter case, blanks and tabs."""
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
    """Return the reply to a line that must be refused, with a reason."""
    refused = parse(line)
    assert isinstance(refused, Refusal)
    assert refused.reason
    assert "\n" not in refused.reason
    return refused.reply


@given(st.data(), commands)
def test_letter_case_and_blanks_do_not_matter(data, command):
    words = [fitting(each) for each in command.parameters]
    line = data.draw(mangled(command.name.split()))
    if words or data.draw(st.booleans()):
        line += ":" + data.draw(mangled(words))
    assert parse(line) == Request(command, tuple(map(float, words)), "")


def test_angles_of_more_than_a_turn_are_remarked() -> None:
    request = parse("lin move : 1 2 3 7 0 -180 0.5 0")
    assert isinstance(request, Request)
    assert request.in_degrees == "alpha = 7 is more than a turn: angles are in rad, not in degrees"


@given(taking_numbers, st.integers(0, 20))
def test_too_few_parameters_are_an_error_and_surplus_ones_are_counted(command, count):
    known = (*command.parameters, *command.optional)
    words = ([fitting(each) for each in known] + ["0.5"] * count)[:count]
    line = f"{command.name} : {' '.join(words)}"
    if count >= len(known):
        assert parse(line) == Request(command, tuple(map(float, words[: len(known)])), "", count - len(known))
    elif count == len(command.parameters):
        assert parse(line) == Request(command, tuple(map(float, words)), "")
    else:
        assert refusal(line) == ERROR


@pytest.mark.parametrize(
    "line",
    ["", " ", "\t \t", ":", " : ", "::", "get status::", "get status : :", "lin move : 1 : 2", "getstatus",
     "get", "lin move 1 2", "hello robot", "get\x0bstatus", "g\u00eat status", "\u017ftop"],
)  # fmt: skip
def test_an_unknown_name_is_an_unknown_command(line):
    assert refusal(line) == UNKNOWN_COMMAND
