"""Files of commands: names and ends of moves, and lines that cannot be run."""

from __future__ import annotations

from pathlib import Path

import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.plot.motion import Motion, run
from iiwa_sim.recordings import RecordingFault

LIN = "lin move : 450 100 520 0 -1.57079 0 0.5 20"
JOINT = "joint move : 0 0.5 0.2 -1 0 1.5 0 1 1 1 1 1 1 1"


def moved(folder: Path, text: str, rate_hz: int = 500) -> Motion:
    path = folder / "moves.txt"
    path.write_text(f"\ufeff{text}", encoding="utf-8")  # as some editors write it
    return run(path, robot_alone(), rate_hz)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (f"get status\n{LIN}\nwait stopped\n{JOINT}", ["LIN 0.5 r20", "JOINT 1"]),
        ("lin tool relative move : 0 0 10 0 0 0 0.25 0", ["LIN TOOL RELATIVE 0.25"]),
    ],
)
def test_moves_have_names_and_end_at_their_goals(text: str, names: list[str], tmp_path: Path) -> None:
    motion = moved(tmp_path, text)
    assert [move.name for move in motion.moves] == names
    for move in motion.moves:
        assert move.end_s is not None
        assert motion.states[round(500 * move.end_s)].tool_frame[:3] == pytest.approx(move.goal_mm, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello\n\nlin move : 1 2", "line 3: 'lin move : 1 2': 3040 lin move takes x y z alpha"),
        (f"{LIN}\nbye\n{LIN}", f"line 3: '{LIN}': "),
        (
            f"hello\nwait 1 s\n{LIN}",
            "line 2: 'wait 1 s': expected 'wait SECONDS', 0 to 600, or 'wait stopped'",
        ),
    ],
)
def test_a_rejected_command_is_named_with_line_and_reason(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(RecordingFault) as caught:
        moved(tmp_path, text, rate_hz=100)
    assert "moves.txt: line " in str(caught.value)
    assert message in str(caught.value)
