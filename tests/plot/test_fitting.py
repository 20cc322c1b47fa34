"""What the scene and the views show of parts: those that matter whole, others as far as they come into it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from iiwa_sim.plot.draw import draw
from iiwa_sim.plot.fitting import corners_mm, seen_mm
from iiwa_sim.plot.record import Array, Recording
from tests.cell.cells import GRIPPER, cell_from
from tests.plot.scripts import recorded_in

LIFTS = """
ptp move : 600 0 60 3.14159 0 3.14159 1 0
wait stopped
set output : 1 1
wait 0.8
lin move : 600 50 100 3.14159 0 3.14159 1 0
"""
MOVES = "ptp move : 600 0 200 3.14159 0 3.14159 1 0"
SHORT = "lin relative move : 1 0 0 0 0 0 0.1 0"
BALL = """
[[part]]
name = "ball {x}"
shape = "sphere"
radius_mm = 20
mass_kg = 0.1
x_mm = {x}
y_mm = {y}
z_mm = {z}
"""


def ball(x: float, y: float, z: float = 50.0) -> str:
    return BALL.format(x=x, y=y, z=z)


def views(figure: Figure) -> list[tuple[Axes, list[int]]]:
    """The views of the TCP, with the axes of the base that they show."""
    return [
        (axes, ["xyz".index(label[0]) for label in (axes.get_xlabel(), axes.get_ylabel())])
        for axes in figure.axes
        if axes.get_title().startswith("TCP seen") and not isinstance(axes, Axes3D)
    ]


def space(figure: Figure) -> Axes3D:
    (found,) = (axes for axes in figure.axes if isinstance(axes, Axes3D))
    return found


def limits(axes: Axes) -> Array:
    found = [axes.get_xlim(), axes.get_ylim()]
    return np.array([*found, axes.get_zlim()] if isinstance(axes, Axes3D) else found).T


@pytest.fixture(scope="module")
def lifted(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("cell")
    return recorded_in(cell_from(folder, GRIPPER + ball(600, -80) + ball(300, -450)), LIFTS, 100)


def test_what_is_held_or_near_is_seen_whole(lifted: Recording) -> None:
    figure = draw(lifted)
    figure.draw_without_rendering()
    for tick in (0, len(lifted.joints) - 1):
        parts = {name: corners_mm(solid) for name, solid in lifted.things.named_parts(tick)}
        for view, axes in [*views(figure), (space(figure), [0, 1, 2])]:
            low, high = limits(view)
            for corners in (parts["block"], parts["ball 600"]):
                assert (corners[:, axes] > low).all()
                assert (corners[:, axes] < high).all()
        (above, axes), _ = views(figure)
        assert parts["ball 300"][:, 1].max() < limits(above)[0][1], "it lies far off"


def test_what_lies_far_off_makes_nothing_smaller(tmp_path: Path) -> None:
    recording = recorded_in(cell_from(tmp_path, GRIPPER + ball(300, -450)), MOVES, 100)
    assert not [each for each in seen_mm(recording) if each[:, 1].max() < -100.0]


@pytest.mark.parametrize(("z", "is_seen"), [(-120.0, True), (2000.0, False)])
def test_what_falls_is_seen_unless_it_is_very_far(tmp_path: Path, z: float, is_seen: bool) -> None:
    recording = recorded_in(cell_from(tmp_path, GRIPPER + ball(300, -600, z)), f"{SHORT}\nwait 0.1", 100)
    assert any(each[:, 1].max() < -500.0 for each in seen_mm(recording)) is is_seen


def test_jaws_are_in_the_views(lifted: Recording) -> None:
    last = len(lifted.joints) - 1
    for view, axes in views(draw(lifted)):
        outlines = [each.get_xy() for each in view.artists + view.patches if isinstance(each, Polygon)]
        for tick in (0, last):
            for jaw in lifted.things.jaws(tick, lifted.tcp(tick)):
                corners = corners_mm(jaw)[:, axes]
                low, high = corners.min(axis=0), corners.max(axis=0)
                assert any(
                    np.allclose(each.min(axis=0), low) and np.allclose(each.max(axis=0), high)
                    for each in outlines
                )


def test_parts_end_where_the_scene_does_as_surfaces_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without that, a part floats in the air beyond the end of the table on which it lies."""
    drawn: list[Array] = []

    set_verts = Poly3DCollection.set_verts

    def shows(body: Poly3DCollection, faces: list[Array], *at_first: bool) -> None:
        set_verts(body, faces, *at_first)
        if not at_first:
            drawn.extend(faces)

    monkeypatch.setattr(Poly3DCollection, "set_verts", shows)
    narrow = GRIPPER.replace("stroke_mm = 80", "stroke_mm = 40")
    at_the_edge, beyond = ball(200, -50), ball(250, -450)
    scene = space(draw(recorded_in(cell_from(tmp_path, narrow + at_the_edge + beyond), MOVES, 100)))
    low, _ = limits(scene)
    assert -70.0 < low[1] < -30.0, "through the ball at the edge"
    assert np.concatenate(drawn)[:, 1].min() == pytest.approx(low[1])
