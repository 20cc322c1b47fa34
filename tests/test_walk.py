"""How many files a command and a tick pass: it is to become fewer, and never more."""

from __future__ import annotations

from tools.walk import walks


async def test_a_lin_move_and_a_tick_pass_few_files() -> None:
    command, ticks = await walks()
    assert command.steps[0].file == "serve/line_connection.py"
    assert "controller/planner.py" in command.files
    assert "dialect/wire/wire_faults.py" not in command.files, "none is set"
    assert len(command.files) <= 14
    assert len(command.steps) <= 21
    widest = max(ticks, key=lambda tick: len(tick.files))
    assert widest.steps[0].file == "controller/motions.py", "what calls it is compiled"
    widths = sorted(len(tick.files) for tick in ticks)
    assert widths[len(widths) // 2] <= 3
    assert widths[-2] <= 7, "all but the tick in which the move is planned"
    assert widths[-1] <= 8
