"""What is told of parts: once each, when it happens."""

from __future__ import annotations

from pathlib import Path

import pytest

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.controller.errors import Refused
from iiwa_sim.handling.part import Part
from iiwa_sim.recordings.read import Recorded
from tests.cell.cells import GRIPPER
from tests.handling.scenes import BLOCK, PIN, TABLE_MM, Scene, at, down

HEIGHT_MM = TABLE_MM + 30.0
HOLDS = ("the gripper holds part 'block'", False)


class Told:
    """A scene with a block and a pin, and what is told of them."""

    def __init__(self, block: Part = BLOCK) -> None:
        self.scene = Scene((block, at(600, 0, HEIGHT_MM)), (PIN, at(600, 150, HEIGHT_MM)))
        self.lines: list[tuple[str, bool]] = []
        self.scene.handling.tell_of_parts(lambda told, warns: self.lines.append((told, warns)))

    def picks(self) -> None:
        self.scene.picks(600, 0, HEIGHT_MM)
        self.scene.robot.step(50)


def test_gripped_and_let_go() -> None:
    told = Told()
    told.picks()
    assert told.lines == [HOLDS]
    told.scene.goes(down(600, 0, HEIGHT_MM + 50.0))
    assert told.lines == [HOLDS], "nothing happens to it"
    told.scene.closes(closed=False)
    told.scene.rests()
    assert told.lines == [HOLDS, ("part 'block' is let go: the jaws have opened", False)]


def test_slipped() -> None:
    told = Told(BLOCK._replace(mass_kg=6.0))
    told.picks()
    told.scene.goes(down(600, 0, HEIGHT_MM + 150.0), 0.2)
    told.scene.rests()
    assert told.lines == [HOLDS, ("part 'block' has slipped out of the jaws", True)]


def test_faults() -> None:
    told = Told()
    told.picks()
    told.scene.handling.remove("pin")
    told.scene.handling.lose()
    told.scene.rests()
    assert told.lines == [
        HOLDS,
        ("part 'pin' is gone: made to through the backdoor", False),
        ("part 'block' falls out of the jaws: made to through the backdoor", False),
    ]
    for fails in (told.scene.handling.lose, lambda: told.scene.handling.remove("pin")):
        with pytest.raises(Refused):
            fails()
    assert len(told.lines) == 3, "what is refused is not told"


def test_a_held_part_that_is_taken_away_is_told_of_once() -> None:
    told = Told()
    told.picks()
    told.scene.handling.remove("block")
    told.scene.rests()
    assert told.lines == [HOLDS, ("part 'block' is gone: made to through the backdoor", False)]


def test_log_dialogue_and_recording_tell_it(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "cell.toml").write_text(GRIPPER)
    caplog.set_level("INFO")
    path = tmp_path / "run.mcap"
    with (
        Simulator(cell=tmp_path / "cell.toml", clock="stepped", record=path) as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        robot.ptp_move((600.0, 0.0, 60.0, 3.14159, 0.0, 3.14159), 1.0, 0.0)
        simulator.run_until_stopped()
        robot.set_output(1, True)
        simulator.advance(0.5)
        simulator.backdoor.save_state("held")
        simulator.backdoor.restore_state("held")  # which is told, not that it holds a part
        simulator.backdoor.lose_part()
    wanted = [HOLDS[0], "part 'block' falls out of the jaws: made to through the backdoor"]
    assert [each.message for each in caplog.records if "'block'" in each.message] == wanted
    happened = [each for each in Recorded(path).events() if each.kind == "part"]
    assert [each.text for each in happened] == wanted
    assert [each.text for each in Recorded(path).dialogue() if each.session == "robot"] == wanted
