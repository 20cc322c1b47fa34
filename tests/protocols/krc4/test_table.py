"""What may stand in protocol/krc4.toml."""

from __future__ import annotations

import pytest

from iiwa_sim.protocols.krc4_xml import read_krc4_table, reply
from iiwa_sim.protocols.table import TableError

HEAD = 'title = "t"\nsource = "s"\n'
STO = '[command.STO]\nid = 1\nsummary = "stop"\nrequirements = []\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title", "krc4.toml: "),
        (HEAD + STO + "more = 1", "unknown field `more`"),
        (HEAD + STO + STO.replace("STO", "FIN"), "command.FIN.id = 1: expected a number of its own"),
        (HEAD + STO.replace("= 1", "= 0"), "command.STO.id = 0"),
        (HEAD + STO + 'inputs = { I1 = "x" }', "command.STO: I1: expected I2 to I9 or R0 to R9"),
        (HEAD + STO + 'outputs = { R10 = "x" }', "command.STO: R10"),
    ],
)
def test_a_fault_in_it_is_told(text: str, message: str) -> None:
    with pytest.raises(TableError, match=message):
        read_krc4_table(text.encode())


def test_a_reply_has_all_twenty_and_no_place_for_what_is_not_finite() -> None:
    wire = reply((1, 2), (0.5,))
    assert wire.startswith(b"<Res><I0>1</I0><I1>2</I1><I2>0</I2>")
    assert b"<R0>0.5</R0><R1>0.0</R1>" in wire
    assert wire.endswith(b"<R9>0.0</R9></Res>")
    with pytest.raises(ValueError, match="nan"):
        reply((), (float("nan"),))
