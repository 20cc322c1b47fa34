"""Commands of the backdoor in JSON are their lines."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.backdoor.json_lines import fields, line_of, reply_in_json
from iiwa_sim.backdoor.line_calls import NotUnderstood
from iiwa_sim.protocols.table import Command, Quantity, Refusal, load_table

TABLE = load_table("backdoor", 7)
COMMANDS = st.sampled_from(list(TABLE.commands.values()))
WORD = st.text("abcXYZ019-_.", min_size=1, max_size=8)


def in_range(quantity: Quantity) -> st.SearchStrategy[float]:
    low = -1e9 if quantity.minimum is None else quantity.minimum
    high = 1e9 if quantity.maximum is None else quantity.maximum
    if quantity.integer:
        return st.integers(int(low), int(high))
    return st.floats(low, high, allow_nan=False)


@given(COMMANDS, st.data())
def test_what_an_object_says_is_what_its_line_says(command: Command, data: st.DataObject) -> None:
    numbers = [data.draw(in_range(each)) for each in command.parameters]
    body: dict[str, object] = {}
    given = iter(numbers)
    for field in fields(command.parameters):
        body[field.name] = next(given) if field.length is None else [next(given) for _ in range(field.length)]
    phrases = [" ".join(data.draw(st.lists(WORD, min_size=1, max_size=3))) for _ in command.phrases]
    body |= dict(zip(command.phrases, phrases, strict=True))
    request = TABLE.parse(line_of(command, json.dumps(body).encode()))
    assert not isinstance(request, Refusal), request
    assert request.command == command
    assert request.values == tuple(map(float, numbers))
    assert request.phrase == " = ".join(phrases)
    assert not phrases or list(request.phrases) == phrases
    assert not request.beyond


def test_a_number_for_each_joint_is_a_list() -> None:
    (field,) = fields(TABLE.commands["place"].parameters)
    assert (field.name, field.length) == ("j", 7)
    assert all(each.length is None for each in fields(TABLE.commands["push"].parameters))


@pytest.mark.parametrize(
    ("name", "body", "reason"),
    [
        ("emergency stop", b"[]", "the body: expected an object in JSON (Expected `object`, got `array`)"),
        ("emergency stop", b"\xff", "the body: expected an object in JSON"),
        ("emergency stop", b'{"why": 1}', "'why': emergency stop takes none"),
        ("advance", b"", "time: expected it in the object, as advance takes time"),
        ("advance", b'{"tme": 1}', "'tme': advance takes time"),
        ("advance", b'{"time": 1, "x\\n\\u0000": 1}', r"'x\n\x00': advance takes time"),
        ("advance", b'{"time": "1"}', "time: expected a number"),
        ("place", b'{"j": [1, 2, 3, 4, 5, 6]}', "j: expected a list of 7 numbers"),
        ("place", b'{"j": [1, 2, 3, 4, 5, 6, "7"]}', "j[6]: expected a number"),
        ("remove surface", b'{"name": 1}', "name: expected a text that is not empty"),
        ("remove surface", b'{"name": "a:b"}', "name = 'a:b': expected printable ASCII without ':'"),
        ("remove surface", '{"name": "Tür"}'.encode(), "name = 'Tür': expected printable ASCII without"),
        ("reply", b'{"command": "a = b", "reply": "c", "times": 1}', "command = 'a = b': expected no '=' in"),
        (
            "reply",
            b'{"command": "get status", "times": 1}',
            "reply: expected it in the object, as reply takes",
        ),
    ],
)
def test_what_is_wrong_is_told(name: str, body: bytes, reason: str) -> None:
    with pytest.raises(NotUnderstood) as caught:
        line_of(TABLE.commands[name], body)
    assert caught.value.reason.startswith(reason)
    assert caught.value.reason.isprintable()
    assert len(caught.value.reason) < 500


@given(COMMANDS, st.binary(max_size=50))
def test_no_body_makes_anything_but_a_line_or_a_refusal(command: Command, body: bytes) -> None:
    try:
        line = line_of(command, body)
    except NotUnderstood:
        return
    assert b"\n" not in line
    assert TABLE.find(line.partition(b":")[0]) == command


@pytest.mark.parametrize(
    ("name", "reply", "value"),
    [
        ("hello", "hello", "hello"),
        ("advance", "done", "done"),
        ("run until stopped", "1.25", {"time": 1.25}),
        (
            "get tool",
            "1.0 2.0 3.0 0.1 0.2 0.3",
            dict(zip(("x", "y", "z", "alpha", "beta", "gamma"), (1, 2, 3, 0.1, 0.2, 0.3), strict=True)),
        ),
        ("get inputs", "0 1", [0, 1]),
        ("get surfaces", '["the table"]', ["the table"]),
        ("get connections", "{}", {}),
        ("get clock", "10x paused", "10x paused"),
    ],
)
def test_replies(name: str, reply: str, value: object) -> None:
    assert reply_in_json(TABLE.commands[name], reply) == value
