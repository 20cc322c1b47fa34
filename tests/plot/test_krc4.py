"""KRC4 messages as a file of commands."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.plot.script import Command, parse_script
from tests.plot.scripts import recorded

SIX_AXES = "kr_6_r900_sixx"
MOVES = """dialect krc4
Cmd I1=10 R0=445 R1=20 R2=800 R3=170 R4=10 R5=170
<Cmd I1="100"/>
wait stopped
Cmd I1=25 R1=-90 R2=90 R4=90 # home
"""


@pytest.mark.parametrize(
    ("robot", "text", "moves"),
    [
        (SIX_AXES, MOVES, 2),
        ("lbr_iiwa_7_r800", "dialect krc4\nCmd I1=320\nCmd I1=25 R1=20 R3=-60 R5=70 R6=5\n", 1),
    ],
)
def test_moves_are_recorded_with_their_targets(robot: str, text: str, moves: int) -> None:
    recording = recorded(text, robot)
    assert len(recording.targets) == moves
    assert all(target.done_tick is not None for target in recording.targets)
    for target in recording.targets:
        assert recording.tcp_mm[target.done_tick] == pytest.approx(target.tcp_mm, abs=1e-3)
    assert not np.array_equal(recording.joints[0], recording.joints[len(recording.joints) // 2])


def test_the_targets_are_those_of_the_messages() -> None:
    lin, pta = recorded(MOVES, SIX_AXES).targets
    assert (lin.line, lin.blending_mm, lin.servo) == (2, 0.0, False)
    assert lin.tcp_mm == pytest.approx((445.0, 20.0, 800.0))
    assert pta.line == 5
    assert pta.tcp_mm == pytest.approx((445.0, 0.0, 810.0))


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("Cmd I1=20 R0=9999", "out of reach"),
        ("Cmd I1", "'I1': expected NAME=VALUE"),
        ("Cmd I1=999", "no command has the id 999"),
        ("hello", "with <; the connection ends; lines of text go to a robot with --dialect iiwa"),
        ("<Cmd>", "expected a whole message"),
        ("<Cmd I1='100'/><Cmd I1='100'/>", "expected one message"),
    ],
)
def test_a_message_that_is_refused_ends_it_with_one_line(line: str, told: str) -> None:
    with pytest.raises(PlotFault) as caught:
        recorded(f"dialect krc4\n{line}\n", SIX_AXES)
    assert str(caught.value).startswith(f"moves.txt: line 2: '{line}': ")
    assert told in str(caught.value)


@pytest.mark.parametrize(
    "text", ["dialect", "dialect klingon\nhello", "dialect krc4 x", "hello\ndialect krc4"]
)
def test_a_dialect_that_is_none_or_comes_too_late(text: str) -> None:
    with pytest.raises(PlotFault, match="expected iiwa or krc4, above all commands"):
        parse_script("moves.txt", text.encode())


def test_a_script_knows_its_dialect() -> None:
    script = parse_script("moves.txt", b"dialect  krc4 # messages\nCmd I1=1\n")
    assert (script.dialect, script.steps) == ("krc4", (Command(2, "Cmd I1=1"),))
    assert parse_script("moves.txt", b"hello\n").dialect == "iiwa"
