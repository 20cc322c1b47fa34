"""Contact forces in the two example cells."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.cell.cell import load_cells
from tests.cell.cells import EXAMPLES, SteppedDriver

DOWN = "3.14159265359 0 3.14159265359"
"""Orientation on the wire of a tool that points down."""


@pytest.fixture
def table() -> SteppedDriver:
    return SteppedDriver(load_cells(EXAMPLES / "table.toml")[0])


@pytest.fixture
def peg() -> SteppedDriver:
    return SteppedDriver(load_cells(EXAMPLES / "peg.toml")[0])


@pytest.mark.parametrize("depth_mm", [0.05, 2.5])
def test_the_table_pushes_back_with_stiffness_times_depth(table: SteppedDriver, depth_mm: float) -> None:
    assert table.force() == [0.0] * 6
    assert table.ask("get joint torque") == " ".join(["0.0"] * 7)
    table.moves(f"lin move : 600 0 {303 - depth_mm} {DOWN} 0.2 0")
    fx, fy, fz, *torque = table.force()
    assert fz == pytest.approx(-20.0 * depth_mm, rel=1e-6), "along z of the tool, that points down"
    assert (fx, fy) == pytest.approx((0.0, 0.0), abs=0.2 * 20.0 * depth_mm)
    assert np.abs(torque).max() <= 0.003 * 0.2 * 20.0 * depth_mm + 1e-9
    torques = [float(word) for word in table.ask("get joint torque").split()]
    assert abs(torques[1]) == pytest.approx(0.6 * 20.0 * depth_mm, rel=0.01), "600 mm from the axis of A2"
    table.moves(f"lin move : 600 0 310 {DOWN} 0.2 0")
    assert table.force() == [0.0] * 6


def test_the_peg_goes_into_the_hole_without_a_touch(peg: SteppedDriver) -> None:
    peg.moves(f"lin move : 600 0 290 {DOWN} 0.5 0")
    assert peg.ask(f"lin move : 600 0 210 {DOWN} 0.3 0") == "done"
    while peg.ask("get status") == "moving":
        peg.controller.step()
        assert peg.force() == [0.0] * 6
    peg.moves(f"lin move : 600 0 209 {DOWN} 0.3 0")
    assert peg.force()[2] == pytest.approx(-50.0 * 0.5), "the bottom, half a millimetre deep"


@pytest.mark.parametrize(("x_mm", "y_mm"), [(-1.0, 0.0), (1.0, -1.0)])
def test_the_walls_push_the_peg_back_to_the_middle(peg: SteppedDriver, x_mm: float, y_mm: float) -> None:
    peg.moves(f"lin move : 600 0 230 {DOWN} 0.5 0")
    peg.moves(f"lin move : {600 + x_mm} {y_mm} 230 {DOWN} 0.2 0")
    fx, fy, *_ = peg.force()
    half = 50.0 * 0.5
    # The tool points down: its y is that of the base, its x points in the other direction.
    assert (fx, fy) == pytest.approx((x_mm * half, -y_mm * half), rel=1e-3, abs=0.21 * half)
