"""Files of commands: what they say, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.plot.motion import Command, PlotFault, Wait, parse_script, read_script

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


@pytest.mark.parametrize(
    "wait", ["wait", "wait -1", "wait 601", "wait : 1", "wait 1 s", "wait long", "wait nan", "wait 1_0"]
)
def test_a_wait_that_is_none(wait: str) -> None:
    with pytest.raises(PlotFault) as caught:
        parse_script("moves.txt", f"hello\n{wait}".encode())
    told = str(caught.value)
    assert told == f"moves.txt: line 2: '{wait}': expected 'wait SECONDS', 0 to 600, or 'wait stopped'"


@pytest.mark.parametrize("data", [b"", b"\n\n", b"# only words\n"])
def test_a_file_without_commands(data: bytes) -> None:
    with pytest.raises(PlotFault, match=r"^moves.txt: expected commands, one per line, and found none$"):
        parse_script("moves.txt", data)


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


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "missing.txt", "No such file or directory"), (tmp_path, "Is a directory")):
        with pytest.raises(PlotFault) as caught:
            read_script(str(path))
        assert str(caught.value).endswith(f": cannot be read: {why}")


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "moves.png"
    path.write_bytes(b"\x89PNG\r\n")
    with pytest.raises(PlotFault, match="expected text in UTF-8"):
        read_script(str(path))


def test_a_file_without_end() -> None:
    with pytest.raises(PlotFault, match="of at most 10000000 bytes"):
        read_script("/dev/zero")
