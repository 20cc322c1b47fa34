"""Files of commands: what they say, and what is wrong with them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.plot.motion import Command, PlotFault, Wait, parse_script

TEXT = b"""\xef\xbb\xbf# a heading

hello
  Lin Move : 1 2 3 # behind a command
wait 0.5\r
\tWAIT  stopped\t# until then
wait 1e-3
   # nothing else
stop"""


def test_commands_waits_comments_and_blank_lines() -> None:
    assert parse_script("moves.txt", TEXT).steps == (
        Command(3, "hello"),
        Command(4, "Lin Move : 1 2 3"),
        Wait(5, "wait 0.5", 0.5),
        Wait(6, "WAIT  stopped", None),
        Wait(7, "wait 1e-3", 0.001),
        Command(9, "stop"),
    )


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
