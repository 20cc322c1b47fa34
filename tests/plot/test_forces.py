"""Forces and thresholds: what a recording keeps of them, and what is drawn."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.figure import Figure

from iiwa_sim.cell.cell import load_cell, robot_alone
from iiwa_sim.contact.noise import NoiseLevels
from iiwa_sim.frames import Frame
from iiwa_sim.plot.draw import draw, picture
from iiwa_sim.plot.record import Recording, record
from iiwa_sim.plot.script import read_script
from tests.asked import lin_force_move, lin_move
from tests.plot.scripts import EXAMPLES, JOINT, LIN, TABLE, recorded, recorded_in

DOWN = "3.14159265359 0 3.14159265359"
PROBE = f"linforce move : 600 0 280 {DOWN} 0.1 0 10 20 30"
UP = f"lin move : 600 0 320 {DOWN} 0.5 0"


@pytest.fixture(scope="module")
def probing() -> Recording:
    return recorded_in(load_cell(TABLE), f"{UP}\n{PROBE}\n{UP}")


def force_panel(figure: Figure) -> Axes:
    (found,) = [axes for axes in figure.axes if axes.get_ylabel() == "force at the TCP (N)"]
    return found


def bands(axes: Axes) -> list[tuple[float, ...]]:
    """Of each: the first and last time, and the lowest and highest force."""
    found = [each for each in axes.collections if isinstance(each, FillBetweenPolyCollection)]
    boxes = [path.get_extents() for each in found for path in each.get_paths() if len(path)]
    return [(box.x0, box.x1, box.y0, box.y1) for box in boxes if np.isfinite(box.get_points()).all()]


def test_forces_are_those_of_the_controller_bit_for_bit(probing: Recording) -> None:
    cell = load_cell(TABLE)
    contacts = []
    controller = cell.controller(
        0.002, on_contact=lambda contact: contacts.append((controller.tick, contact))
    )
    down = Frame(600, 0, 280, 3.14159265359, 0, 3.14159265359)
    controller.move(lin_move(down._replace(z_mm=320), 0.5, 0.0))
    controller.move(lin_force_move(down, 0.1, 0.0, (10.0, 20.0, 30.0)))
    controller.move(lin_move(down._replace(z_mm=320), 0.5, 0.0))
    forces = [controller.cartesian_force()[:3]]
    for _ in range(len(probing.force_n) - 1):
        controller.step()
        forces.append(controller.cartesian_force()[:3])
    assert np.array_equal(probing.force_n, forces)
    assert not controller.moving
    (watch,) = probing.watches
    ((tick, contact),) = contacts
    assert watch.contact == contact
    assert watch.ticks is not None
    assert watch.ticks[1] == tick == probing.targets[1].done_tick
    assert watch.ticks[0] == probing.targets[0].done_tick
    assert (watch.thresholds_n, watch.offset_n) == ((10.0, 20.0, 30.0), (0.0, 0.0, 0.0))
    inside = probing.force_n[watch.ticks[0] : tick, 2]
    assert np.abs(inside).max() <= 30.0 < abs(probing.force_n[tick, 2])


def test_a_threshold_counts_from_the_force_at_the_command() -> None:
    press = f"lin move : 600 0 302 {DOWN} 0.2 0"
    again = f"linforcez move : 600 0 280 {DOWN} 0.02 0 5"
    recording = recorded_in(load_cell(TABLE), f"{press}\nwait stopped\n{again}")
    (watch,) = recording.watches
    assert watch.thresholds_n == (None, None, 5.0)
    assert watch.offset_n[2] == pytest.approx(-20.0)
    low, high = bands(force_panel(draw(recording)))[0][2:]
    assert (low, high) == pytest.approx((-25.0, -15.0))


def test_curves_bands_and_what_left_them(probing: Recording) -> None:
    axes = force_panel(draw(probing))
    curves = {str(line.get_label()): line for line in axes.lines}
    for axis in range(3):
        line = curves[f"along {'xyz'[axis]}"]
        assert np.array_equal(line.get_xdata(), probing.times_s())
        assert np.array_equal(line.get_ydata(), probing.force_n[:, axis])
    (watch,) = probing.watches
    assert watch.ticks is not None
    assert watch.contact is not None
    first_s, last_s = (watch.ticks[0] - 1) * 0.002, watch.ticks[1] * 0.002
    drawn = bands(axes)
    assert [band[:2] for band in drawn] == [pytest.approx((first_s, last_s))] * 3
    assert [band[2:] for band in drawn] == [(-10.0, 10.0), (-20.0, 20.0), (-30.0, 30.0)]
    (mark,) = [line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())]
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (last_s, watch.contact.force_n)
    assert mark.get_color() == curves["along z"].get_color()
    low, high = axes.get_ylim()
    assert low < probing.force_n.min() < 30.0 < high


def test_places_in_which_forces_have_ended_moves(probing: Recording) -> None:
    figure = draw(probing)
    (above,) = [axes for axes in figure.axes if axes.get_title() == "TCP seen from above"]
    (ended,) = [line for line in above.lines if line.get_label() == "ended by a force"]
    (watch,) = probing.watches
    assert watch.contact is not None
    assert ended.get_xydata().tolist() == [list(watch.contact.tcp[:2])]


def test_without_forces_and_force_moves_there_is_no_panel() -> None:
    in_the_air = recorded_in(load_cell(TABLE), f"{UP}\n{JOINT}")
    for recording in (recorded(f"{LIN}\n{JOINT}"), in_the_air):
        assert not recording.has_forces
        assert [axes for axes in draw(recording).axes if "force" in axes.get_ylabel()] == []


def test_a_force_move_that_meets_nothing_shows_its_band() -> None:
    recording = recorded("linforcez move : 450 100 520 0 -1.57079 0 0.5 0 12.5")
    (watch,) = recording.watches
    assert watch.contact is None
    axes = force_panel(draw(recording))
    assert [band[2:] for band in bands(axes)] == [(-12.5, 12.5)]
    low, high = axes.get_ylim()
    assert low < -12.5 < 12.5 < high < 20.0


def test_a_force_move_that_never_began_has_no_band() -> None:
    recording = recorded(f"{LIN}\nlinforcez move : 450 0 520 0 -1.57079 0 0.5 0 9\nwait 0.1\nstop")
    assert [watch.ticks for watch in recording.watches] == [None]
    assert bands(force_panel(draw(recording))) == []


@pytest.mark.slow
@pytest.mark.parametrize("threshold", ["1e-300", "1e300", "1.7e308"])
@pytest.mark.parametrize(
    "cell", [pytest.param(robot_alone(), id="alone"), pytest.param(load_cell(TABLE), id="table")]
)
def test_any_threshold_can_be_drawn(threshold: str, cell: object) -> None:
    assert isinstance(cell, type(robot_alone()))
    text = f"{UP if cell.surfaces else LIN}\n{PROBE.replace('10 20', f'{threshold} {threshold}')}"
    if not cell.surfaces:
        text = f"linforcez move : 450 100 520 0 -1.57079 0 0.5 0 {threshold}"
    recording = recorded_in(cell, text)
    assert picture(recording, "svg")
    assert force_panel(draw(recording)).get_ylim()[1] < inf


def test_noise_is_a_force_to_see() -> None:
    cell = replace(robot_alone(), noise_levels=NoiseLevels(3, 0.5, 0.0, 0.0))
    recording = recorded_in(cell, LIN)
    assert recording.has_forces
    assert 0.3 < recording.force_n.std() < 0.7
    assert force_panel(draw(recording))


def test_the_example_shows_what_it_says() -> None:
    recording = record(read_script(str(EXAMPLES / "probing.txt")), load_cell(TABLE), 500)
    contacts = [watch.contact for watch in recording.watches]
    assert [contact and contact.axis for contact in contacts] == ["z", "y", "y"]
    assert abs(recording.watches[2].offset_n[1]) > 20.0, "it presses already"
    assert all(target.done_tick is not None for target in recording.targets)
