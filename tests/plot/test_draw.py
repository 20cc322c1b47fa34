"""What is on the picture."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
import pytest

from iiwa_sim.plot.motion import Motion
from tests.plot.scripts import JOINT, LIN, moved

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw(motion: Motion) -> Figure:
    """Draw a motion. Only the worker that runs these tests loads Matplotlib."""
    figure: Figure = import_module("iiwa_sim.plot.draw").draw(motion)
    return figure


@pytest.fixture(scope="module")
def motion() -> Motion:
    return moved(f"{LIN}\nlin move : 450 100 400 0 -1.57079 0 0.5 30\n{JOINT}", rate_hz=100)


@pytest.fixture(scope="module")
def figure(motion: Motion) -> Figure:
    return draw(motion)


def panel(figure: Figure, label: str) -> Axes:
    (found,) = [axes for axes in figure.axes if label in (axes.get_ylabel(), axes.get_title())]
    return found


def texts(axes: Axes) -> list[str]:
    return [each.get_text() for each in axes.texts]


def test_joints_and_tcp_over_time(motion: Motion, figure: Figure) -> None:
    robot = motion.description
    for label, values in (
        ("joints (deg)", np.degrees(motion.joints)),
        ("joint velocities\n(% of limits)", 100.0 * motion.velocity / robot.velocity),
        ("TCP (mm)", motion.tcp_mm),
        ("TCP speed (mm/s)", motion.tcp_speed_mm_s()[:, None]),
    ):
        for line, column in zip(panel(figure, label).lines, values.T, strict=False):
            assert np.array_equal(line.get_xdata(), motion.times_s)
            assert np.asarray(line.get_ydata()) == pytest.approx(column)
    assert texts(panel(figure, "joints (deg)")) == ["1", "2", "3"]
    assert not [axes for axes in figure.axes if "force" in axes.get_ylabel()]
