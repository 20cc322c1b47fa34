"""Replies as KRC4 messages."""

from __future__ import annotations

import pytest

from iiwa_sim.protocols.krc4_xml import reply


def test_a_reply_has_all_twenty_and_no_place_for_what_is_not_finite() -> None:
    wire = reply((1, 2), (0.5,))
    assert wire.startswith(b"<Res><I0>1</I0><I1>2</I1><I2>0</I2>")
    assert b"<R0>0.5</R0><R1>0.0</R1>" in wire
    assert wire.endswith(b"<R9>0.0</R9></Res>")
    with pytest.raises(ValueError, match="nan"):
        reply((), (float("nan"),))
