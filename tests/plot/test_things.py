"""Jaws, parts and touches of links, in pictures of files of commands and of recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from iiwa_sim.cell.cell import load_cell
from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.meetings import LinkTouch
from iiwa_sim.frames import Frame, apply, inverse
from iiwa_sim.plot.arm import flange as flange_at
from iiwa_sim.plot.draw import draw
from iiwa_sim.plot.film import _staged
from iiwa_sim.plot.record import Recording
from iiwa_sim.plot.recorded import drawn_from
from iiwa_sim.plot.solids import polygons
from iiwa_sim.plot.things import Things, ThingsOverTime, shapes_of
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.robot.model import Model
from tests.cell.cells import cell_from
from tests.plot.scripts import recorded_in
from tests.recordings.recorded import Robot
from tests.recordings.test_gripper import CELL

CARRIES = """
ptp move : 600 0 60 3.14159 0 3.14159 1 0
wait stopped
set output : 1 1
wait 0.8
lin move : 600 100 160 3.14159 0 3.14159 1 0
"""
GRIPS_M = 0.04
CLOSED = GripperState(0.0, "closed")


@pytest.fixture(scope="module")
def carried(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    cell = tmp_path_factory.mktemp("cell") / "cell.toml"
    cell.write_text(CELL)
    return recorded_in(load_cell(cell), CARRIES, 100)


def test_what_is_carried_goes_where_the_tcp_goes(carried: Recording) -> None:
    last = len(carried.joints) - 1
    block, pin = carried.things.parts(last)
    assert block.pose.translation == pytest.approx((0.6, 0.1, 0.16), abs=0.005)
    assert pin == carried.things.parts(0)[1]
    assert carried.things.at(0).gripper == GripperState(80.0, "open")
    gripper = carried.things.at(last).gripper
    assert gripper is not None
    assert (gripper.opening_mm, gripper.state) == (pytest.approx(40.0, abs=0.01), "holds")


def test_jaws_stand_at_both_sides_of_what_they_hold(carried: Recording) -> None:
    last = len(carried.joints) - 1
    first, second = carried.things.jaws(last, carried.tcp(last))
    block = carried.things.parts(last)[0]
    between = np.subtract(first.pose.translation, second.pose.translation)
    assert np.linalg.norm(between) == pytest.approx(GRIPS_M + 0.008, abs=1e-5)
    middle = np.add(first.pose.translation, second.pose.translation) / 2.0
    assert middle[:2] == pytest.approx(block.pose.translation[:2], abs=0.003)


TOOL = "[tool]\nmass_kg = 1\ncapsules_mm = [[0, 0, 30, 0, 40, 70, 25], [0, 0, 10, 0, 0, 10, 20]]\n"


def test_the_tool_is_where_the_flange_is(tmp_path: Path) -> None:
    """Its capsules, in pictures, films, and pictures of recordings."""
    cell = cell_from(tmp_path, TOOL + CELL)
    drawn = recorded_in(cell, "ptp move : 600 100 260 3.14159 0 3.14159 1 0", 100)
    robot = Robot(tmp_path / "run.mcap", cell)
    robot.step()
    robot.end()
    model = Model(cell.description)
    for recording in (drawn, drawn_from(Recorded(tmp_path / "run.mcap"))):
        last = len(recording.joints) - 1
        flange = model.flange(recording.joints[last].tolist())
        rod, ball = recording.things.tool(flange_at(recording, last))
        assert rod.shape == (pytest.approx(0.025), pytest.approx(0.5e-3 * np.hypot(40.0, 40.0)))
        assert ball.shape == (pytest.approx(0.02), 0.0)
        assert apply(inverse(flange), ball.pose.translation) == pytest.approx((0.0, 0.0, 0.01))
        ends = [apply(rod.pose, (0.0, 0.0, side * rod.shape[1])) for side in (-1.0, 1.0)]
        wanted = [apply(flange, each) for each in ((0.0, 0.0, 0.03), (0.0, 0.04, 0.07))]
        assert np.array(ends) == pytest.approx(np.array(wanted))
    surfaces, tool, jaws, parts = 1, 2, 2, 2
    assert len(bodies(draw(drawn))) == surfaces + 5 * (tool + jaws + parts)
    figure, show = _staged(drawn)
    show(len(drawn.joints) - 1)
    assert len(bodies(figure)) == surfaces + tool + jaws + parts


def bodies(figure: Figure) -> list[Poly3DCollection]:
    (space,) = (axes for axes in figure.axes if isinstance(axes, Axes3D))
    return [each for each in space.collections if isinstance(each, Poly3DCollection)]


def test_a_picture_shows_them_at_each_instant(carried: Recording) -> None:
    surfaces, jaws, parts = 1, 2, 2
    assert len(bodies(draw(carried))) == surfaces + 5 * (jaws + parts)


def test_a_film_moves_them(carried: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    _, show = _staged(carried)
    shown: list[Any] = []
    monkeypatch.setattr(Poly3DCollection, "set_verts", lambda _, faces: shown.append(faces))
    last = len(carried.joints) - 1
    for tick in (0, last):
        shown.clear()
        show(tick)
        wanted = [*carried.things.jaws(tick, carried.tcp(tick)), *carried.things.parts(tick)]
        assert len(shown) == len(wanted) == 4
        for faces, solid in zip(shown, wanted, strict=True):
            assert np.array_equal(np.concatenate(faces), np.concatenate(polygons(solid)))


def test_a_recording_shows_what_a_file_of_commands_shows(tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    cell.write_text(CELL)
    robot = Robot(tmp_path / "run.mcap", load_cell(cell))
    robot.controller.io.set_output(1, True)
    robot.step(200)
    handling = robot.controller.handling
    assert handling is not None
    opening_mm, parts = handling.state.opening_mm, handling.parts
    robot.end()
    found = drawn_from(Recorded(tmp_path / "run.mcap"))
    last = found.things.at(len(found.joints) - 1)
    assert last.gripper is not None
    assert last.gripper.opening_mm == opening_mm < 80.0
    assert [part.name for part in last.parts] == [part.name for part in parts] == ["block", "pin"]
    assert found.things.shapes == {"block": Box(0.02, 0.02, 0.03), "pin": Cylinder(0.01, 0.03)}
    jaws = found.things.jaws(len(found.joints) - 1, Frame(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert [jaw.shape for jaw in jaws] == [Box(*(pytest.approx(each) for each in (0.01, 0.004, 0.035)))] * 2


def touch(link: str, surface: str, x: float) -> LinkTouch:
    return LinkTouch(link, surface, (x, 0.0, 0.0), (0.0, 0.0, 1.0))


def test_a_touch_is_marked_where_it_began() -> None:
    things = ThingsOverTime()
    things.add(Things(0, None, (), ()))
    things.add(Things(5, None, (), (touch("link_4", "table", 1.0),)))
    things.add(Things(6, None, (), (touch("link_4", "table", 2.0), touch("link_5", "table", 3.0))))
    things.add(Things(7, None, (), ()))
    things.add(Things(9, None, (), (touch("link_4", "table", 4.0),)))
    assert [x for x, _, _ in things.touches_mm] == [1.0, 3.0, 4.0]


def test_what_there_is_holds_until_something_changes() -> None:
    part = PartState("it", Frame(1.0, 2.0, 3.0, 0.0, 0.0, 0.0), "lies")
    things = ThingsOverTime({"it": Sphere(0.1)})
    things.add(Things(3, CLOSED, (part,), ()))
    things.add(Things(4, CLOSED, (part,), ()))
    things.add(Things(8, CLOSED, (PartState("it", part.frame, "gone"),), ()))
    assert things.at(2) == Things(2, None, (), ())
    assert things.at(7) == Things(3, CLOSED, (part,), ())
    assert [solid.shape for solid in things.parts(7)] == [Sphere(0.1)]
    assert not things.parts(8)


def test_a_part_of_no_known_shape_is_refused() -> None:
    with pytest.raises(ValueError, match="expected a part with a shape"):
        shapes_of([{"name": "it", "shape": "torus"}])
