"""Files of commands: what they say, and what is wrong with them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.plot.motion import Command, PlotFault, Wait, parse_script


@given(st.binary(max_size=80))
def test_any_bytes_are_a_script_or_told_in_one_line(data: bytes) -> None:
    told = ""
    steps: tuple[Command | Wait, ...] = ()
    try:
        steps = parse_script("moves.txt", data).steps
    except PlotFault as fault:
        told = str(fault)
    assert bool(told) != bool(steps)
    assert told.isprintable()
    assert told.startswith("moves.txt: " if told else "")
    assert [step.line for step in steps] == sorted({step.line for step in steps})
    assert all(step.text and "#" not in step.text for step in steps)
