"""What is on the picture."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.text import Annotation
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3D, Poly3DCollection

from iiwa_sim.contact.shapes import Box, Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Frame
from iiwa_sim.plot.arm import arm_mm
from iiwa_sim.plot.draw import draw, picture
from iiwa_sim.plot.film import _staged
from iiwa_sim.plot.marks import MOST_NUMBERS, together
from iiwa_sim.plot.record import Recording, Target
from iiwa_sim.plot.recorded import drawn_from
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.robot.model import Model
from tests.cell.cells import cell_from
from tests.plot.scripts import JOINT, LIN, recorded, recorded_in
from tests.recordings.recorded import Robot

PNG_START, PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(f"{LIN}\nlin move : 450 100 400 0 -1.57079 0 0.5 30\n{JOINT}")


@pytest.fixture(scope="module")
def figure(recording: Recording) -> Figure:
    return draw(recording)


def panel(figure: Figure, label: str) -> Axes:
    (found,) = [axes for axes in figure.axes if label in (axes.get_ylabel(), axes.get_title())]
    return found


def curve(axes: Axes, label: str) -> Line2D:
    (found,) = [line for line in axes.lines if line.get_label() == label]
    return found


def texts(axes: Axes) -> list[str]:
    return [each.get_text() for each in axes.texts]


def heights(axes: Axes) -> set[float]:
    """Of the lines across it."""
    return {float(np.asarray(line.get_ydata())[0]) for line in axes.lines if list(line.get_xdata()) == [0, 1]}


def test_joints_over_time_with_their_limits(recording: Recording, figure: Figure) -> None:
    robot = recording.description
    for label, values in (
        ("joint position (deg)", np.degrees(recording.joints)),
        ("joint velocity (% of limit)", 100.0 * recording.velocity() / robot.velocity),
        ("joint acceleration (% of limit)", 100.0 * recording.acceleration() / robot.acceleration),
    ):
        axes = panel(figure, label)
        for joint, name in enumerate(robot.joints):
            assert np.array_equal(curve(axes, name).get_ydata(), values[:, joint])
            assert np.array_equal(curve(axes, name).get_xdata(), recording.times_s())
    for label in ("joint velocity (% of limit)", "joint acceleration (% of limit)"):
        assert heights(panel(figure, label)) == {100.0, -100.0}
        low, high = panel(figure, label).get_ylim()
        assert low < -100.0 < 100.0 < high


def test_strips_go_from_limit_to_limit_and_show_what_was_used(recording: Recording, figure: Figure) -> None:
    strip = panel(figure, "range used")
    robot = recording.description
    thin, thick = strip.lines[::2], strip.lines[1::2]
    assert [label.get_text() for label in strip.get_xticklabels()] == list(robot.joints)
    for joint in range(len(robot.joints)):
        ends = np.degrees([robot.position_min[joint], robot.position_max[joint]])
        assert np.array_equal(thin[joint].get_ydata(), ends)
        used = np.degrees(recording.joints[:, joint])
        assert np.array_equal(thick[joint].get_ydata(), [used.min(), used.max()])
    low, high = strip.get_ylim()
    assert low < np.degrees(min(robot.position_min))
    assert high > np.degrees(max(robot.position_max))


def test_the_speed_of_the_tcp(recording: Recording, figure: Figure) -> None:
    axes = panel(figure, "TCP speed (mm/s)")
    assert np.array_equal(axes.lines[0].get_ydata(), recording.tcp_speed_mm_s())


def test_numbers_of_targets_over_time(recording: Recording, figure: Figure) -> None:
    axes = panel(figure, "joint position (deg)")
    assert texts(axes) == ["1", "2", "3"]
    at_s = [cast(Annotation, each).xy[0] for each in axes.texts]
    ticks = [target.done_tick for target in recording.targets]
    assert at_s == [tick * recording.tick_s for tick in ticks if tick is not None]


@pytest.mark.parametrize(
    ("title", "axes"), [("TCP seen from above", [0, 1]), ("TCP seen from the front", [1, 2])]
)
def test_views_of_the_tcp_are_to_scale(
    recording: Recording, figure: Figure, title: str, axes: list[int]
) -> None:
    view = panel(figure, title)
    assert view.get_aspect() == 1.0
    assert view.get_xlabel() == f"{'xyz'[axes[0]]} (mm)"
    assert np.array_equal(curve(view, "TCP").get_xydata(), recording.tcp_mm[:, axes])
    spheres = [patch for patch in view.patches if isinstance(patch, Circle)]
    assert [sphere.radius for sphere in spheres] == [20.0, 30.0]
    centres = np.array([target.tcp_mm for target in recording.targets])[:, axes]
    assert np.array_equal([sphere.center for sphere in spheres], centres[:2])
    assert np.array_equal(curve(view, "target").get_xydata(), centres)


def test_the_other_view_is_along_the_way() -> None:
    assert panel(draw(recorded("lin move : 400 0 520 0 -1.57079 0 0.5 0")), "TCP seen from the side")


def test_what_does_not_move_is_drawn() -> None:
    figure = draw(recorded("hello"))
    low, high = panel(figure, "TCP seen from above").get_xlim()
    assert high - low > 1.0


def test_a_stop_shows_the_limit_it_has() -> None:
    figure = draw(recorded(f"{JOINT.replace('0.5 0.2', '0.5 1.2')}\nwait 0.2\nstop"))
    axes = panel(figure, "joint acceleration (% of limit)")
    assert texts(axes) == ["limit", "limit in a stop"]
    assert heights(axes) == {100.0, -100.0, 400.0, -400.0}


def test_the_beginning_of_the_error_state_is_marked_with_its_code(tmp_path: Path) -> None:
    """In pictures of commands, of recordings, and in films."""
    cell = cell_from(tmp_path, "[safety]\ntcp_speed_mm_per_s = 20\n")
    stopped = recorded_in(cell, JOINT, 100)
    robot = Robot(tmp_path / "run.mcap", cell)
    robot.step(5)
    robot.recorder.fault(stopped.faults[0].code, "too fast")
    robot.step(10)
    robot.end()
    (fault,) = stopped.faults
    assert stopped.tcp_speed_mm_s()[fault.tick] > 20.0 >= stopped.tcp_speed_mm_s()[fault.tick - 1]
    read = drawn_from(Recorded(tmp_path / "run.mcap"))
    assert [each.code for each in read.faults] == [fault.code]
    for recording, figure in ((stopped, draw(stopped)), (read, draw(read)), (stopped, _staged(stopped)[0])):
        at_s = recording.faults[0].tick * recording.tick_s
        assert f"error {fault.code}" in texts(panel(figure, "joint position (deg)"))
        for label in ("joint position (deg)", "TCP speed (mm/s)"):
            assert [at_s, at_s] in [list(line.get_xdata()) for line in panel(figure, label).lines]


def test_streams_are_dots_without_numbers(recording: Recording) -> None:
    streamed = tuple(Target(each, (450.0, each, 520.0), 0.0, "direct") for each in range(100))
    figure = draw(replace(recording, targets=(*recording.targets[:1], *streamed)))
    view = panel(figure, "TCP seen from above")
    assert texts(view) == ["1"]
    assert len(curve(view, "streamed target").get_xdata()) == 100
    assert "limit in direct mode" in texts(panel(figure, "joint acceleration (% of limit)"))
    figure.draw_without_rendering()
    (legend,) = [each for half in figure.subfigs for each in half.legends]
    assert [text.get_text() for text in legend.get_texts()][-2:] == ["target", "streamed target"]
    box = legend.get_window_extent()
    assert box.x0 > 0.0
    assert box.x1 < figure.bbox.x1


def test_too_many_targets_have_no_numbers(recording: Recording) -> None:
    many = recording.targets * (MOST_NUMBERS // 3 + 1)
    view = panel(draw(replace(recording, targets=many)), "TCP seen from above")
    assert texts(view) == []
    assert len(curve(view, "target").get_xdata()) == len(many)


def test_numbers_at_one_place_share_it() -> None:
    numbered = [((0.0, 0.0), "1"), ((5.0, 0.0), "2"), ((0.1, 0.0), "3")]
    assert together(numbered, 1.0) == [((0.0, 0.0), "1, 3"), ((5.0, 0.0), "2")]
    assert together([((0.0,), str(each)) for each in range(9)], 1.0) == [((0.0,), "0, 1, 2, ..., 8")]


@pytest.mark.slow
@pytest.mark.parametrize("file_format", ["svg", "png"])
def test_the_same_recording_gives_the_same_picture(recording: Recording, file_format: str) -> None:
    """Any name can stand in its title."""
    script = recording.script._replace(path="of/$\\alpha$ \u6f22\n%.txt")
    recording = replace(recording, script=script)
    first = picture(recording, file_format)
    assert first == picture(recording, file_format)
    if file_format == "png":
        assert first.startswith(PNG_START)
        assert first.endswith(PNG_END)
    else:
        assert ET.fromstring(first).tag == "{http://www.w3.org/2000/svg}svg"
        assert b"<dc:date>" not in first


def test_moves_are_named(recording: Recording, figure: Figure) -> None:
    named = ["1 LIN 0.5 r20", "2 LIN 0.5 r30", "3 JOINT 1"]
    assert texts(panel(figure, "moves")) == ["\n".join(named)]
    many = replace(recording, targets=recording.targets * 10)
    columns = [text.split("\n") for text in texts(panel(draw(many), "moves"))]
    assert [len(column) for column in columns] == [20, 10]
    assert columns[1][-1] == "30 JOINT 1"


def test_names_of_all_kinds_of_moves() -> None:
    relative = "lin tool relative move : 0 0 10 0 0 0 0.25 0"
    other = "joint move : 0 0.5 0.2 -1 0 1.4 0 0.5 0.5 0.25 1 1 1 1"
    told = recorded(f"{relative}\n{other}\nset override : 0.5\nwait stopped\nstart gravity : 100\nstop")
    assert [target.name for target in told.targets] == ["LIN TOOL RELATIVE 0.25", "JOINT 0.25-1"]
    assert told.targets[0].done_tick is not None
    assert told.targets[0].tcp_mm == pytest.approx(told.tcp_mm[told.targets[0].done_tick], abs=1e-3)
    krc4 = recorded("dialect krc4\nCmd I1=25 R1=-90 R2=90 R4=10", "kr_6_r900_sixx")
    assert [target.name for target in krc4.targets] == ["PTP"]


def test_the_arm_at_five_instants(recording: Recording, figure: Figure) -> None:
    (space,) = [axes for axes in figure.axes if isinstance(axes, Axes3D)]
    arms = [line for line in space.lines if str(line.get_label()).endswith(" s")]
    last = len(recording.joints) - 1
    ticks = [0, round(last / 4), round(last / 2), round(3 * last / 4), last]
    assert [line.get_label() for line in arms] == [f"{tick * recording.tick_s:.2f} s" for tick in ticks]
    model = Model(recording.description)
    for line, tick in zip(arms, ticks, strict=True):
        points = np.array(cast(Line3D, line).get_data_3d()).T
        assert len(points) == len(recording.description.joints) + 2
        flange = model.flange(recording.joints[tick].tolist())
        assert points[-1] == pytest.approx(1e3 * np.array(flange.translation))
        assert points[0].tolist() == [0.0, 0.0, 0.0]
        assert arm_mm(recording, tick)[-1].tolist() == recording.tcp_mm[tick].tolist()


def test_an_arm_that_does_not_move_is_drawn_once() -> None:
    (space,) = [axes for axes in draw(recorded("hello")).axes if isinstance(axes, Axes3D)]
    assert [line.get_label() for line in space.lines if str(line.get_label()).endswith(" s")] == ["0.00 s"]


def test_surfaces_of_the_cell_are_drawn_and_make_no_view_larger(recording: Recording, figure: Figure) -> None:
    floor = Surface("floor", Plane(), IDENTITY, 1e5, 0.0, 0.0)
    table = Surface("table", Box(2.0, 2.0, 0.1), Frame(0, 0, 200, 0, 0, 0).to_transform(), 1e5, 0.0, 0.0)
    drawn = draw(replace(recording, surfaces=(floor, table)))
    above, front = panel(drawn, "TCP seen from above"), panel(drawn, "TCP seen from the front")
    outlines = [
        [patch.get_xy().max(axis=0)[1] for patch in view.patches if isinstance(patch, Polygon)]
        for view in (above, front)
    ]
    assert outlines == [[pytest.approx(2000.0)], [pytest.approx(0.0), pytest.approx(300.0)]]
    for view, title in ((above, "TCP seen from above"), (front, "TCP seen from the front")):
        assert view.dataLim.get_points() == pytest.approx(panel(figure, title).dataLim.get_points())
    (space,) = [axes for axes in drawn.axes if isinstance(axes, Axes3D)]
    assert len([each for each in space.collections if isinstance(each, Poly3DCollection)]) == 2


def test_a_joint_that_stays_on_another_is_dashed(recording: Recording) -> None:
    joints = recording.joints.copy()
    joints[:, 4] = joints[:, 2]
    axes = panel(draw(replace(recording, joints=joints)), "joint position (deg)")
    assert [curve(axes, name).get_linestyle() for name in ("A3", "A4", "A5")] == ["-", "-", "--"]
