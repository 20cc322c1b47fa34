"""What the backdoor tells of the arm and of what is round it."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.backdoor.described import described_surface
from iiwa_sim.cell.cell import surface_of
from iiwa_sim.cell.surfaces import AnySurface, BoxSettings, CylinderSettings, PlaneSettings, SphereSettings
from iiwa_sim.frames import Frame
from tests.backdoor.bench import Bench

MM = st.floats(-1e3, 1e3)
SIZE = st.floats(1.0, 1e3)
COMMON = {
    "name": st.just("it"),
    "stiffness_n_per_m": st.floats(1.0, 1e7),
    "friction": st.floats(0.0, 10.0),
    "x_mm": MM,
    "y_mm": MM,
    "z_mm": MM,
    "alpha": st.floats(-3.0, 3.0),
    "beta": st.floats(-1.5, 1.5),
    "gamma": st.floats(-3.0, 3.0),
}
SURFACES = st.one_of(
    st.builds(PlaneSettings, **COMMON),
    st.builds(BoxSettings, size_mm=st.tuples(SIZE, SIZE, SIZE), **COMMON),
    st.builds(SphereSettings, radius_mm=SIZE, **COMMON),
    st.builds(CylinderSettings, radius_mm=SIZE, length_mm=SIZE, **COMMON),
)


@given(SURFACES)
def test_a_surface_is_described_by_the_settings_it_was_made_of(settings: AnySurface) -> None:
    told = described_surface(surface_of(settings))
    for key, wanted in msgspec.to_builtins(settings).items():
        assert told[key] == (wanted if isinstance(wanted, str) else pytest.approx(wanted, abs=1e-9)), key


def test_the_cell_is_told_as_it_is_now() -> None:
    backdoor = Bench().backdoor
    backdoor.add_surface(
        BoxSettings(name="block", x_mm=600, y_mm=300, size_mm=(100, 200, 300), stiffness_n_per_m=1e5)
    )
    cell = backdoor.cell()
    assert list(cell.inputs) == [f"input {number}" for number in range(1, 17)]
    assert cell.contact_radius_mm == 0.0
    (block,) = cell.surfaces
    expected = {"shape": "box", "name": "block", "x_mm": 600, "size_mm": (100, 200, 300)}
    assert {key: block[key] for key in expected} == expected
    backdoor.move_surface("block", Frame(500, 300, 50, 0, 0, 0.5))
    assert backdoor.cell().surfaces[0]["x_mm"] == 500
