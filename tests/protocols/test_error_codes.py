"""The table of error codes: complete, in order, and short enough for the wire."""

from __future__ import annotations

import pytest

from iiwa_sim.controller import errors, io
from iiwa_sim.controller.errors import SUCCESS
from iiwa_sim.protocols.table import helped, load_error_codes, load_table
from iiwa_sim.robot import nearest

LONGEST_REPLY = 1000
"""Bytes that a driver takes at once, with room to spare."""
ROWS = load_error_codes()


def test_the_table_has_exactly_the_codes_in_use() -> None:
    given = {
        value
        for module in (errors, nearest, io)
        for name, value in vars(module).items()
        if name.isupper() and isinstance(value, int) and (value >= 3000 or module is io)
    }
    assert set(ROWS) == given - {SUCCESS, io.DEFAULT_COUNT}
    assert list(ROWS) == sorted(ROWS)


@pytest.mark.parametrize("code", ROWS)
def test_help_answers_each_code_in_one_line(code: int) -> None:
    row = ROWS[code]
    assert all(text.isascii() and text.isprintable() for text in (row.meaning, row.cause, row.remedy))
    answer = helped(load_table("iiwa"), str(code))
    assert all(text in answer for text in (str(code), row.meaning, row.cause, row.remedy))
    assert len(answer) < LONGEST_REPLY
