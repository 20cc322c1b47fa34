"""Where dropped and thrown parts come to rest, beside MuJoCo: another engine, and other laws of contact.

`make nightly` installs it; without it they are skipped.
They show that what the fine integration in `test_falling.py` finds is true of other laws, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from iiwa_sim.contact.shapes import Box
from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.handling.falling import FALLS, Body
from iiwa_sim.handling.ground import grounds_of
from iiwa_sim.handling.part import Part
from tests.handling.test_falling import FLOOR, falls

SCENE = """
<mujoco>
  <option timestep="0.0002" cone="elliptic" impratio="10" integrator="implicitfast"/>
  <worldbody>
    <geom type="plane" size="5 5 0.1" friction="{friction} 0 0" condim="3"/>
    <body pos="0 0 {z}">
      <freejoint/>
      <geom type="box" size="0.02 0.02 {half}" mass="0.5" friction="{friction} 0 0" condim="3"/>
    </body>
  </worldbody>
</mujoco>
"""
STEPS = 10_000
CLOSE_M = 1e-3


@pytest.fixture(scope="module")
def mujoco() -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MUJOCO_GL", "disabled")  # it would look for a screen
        yield pytest.importorskip("mujoco", reason="MuJoCo is not installed")


@pytest.mark.parametrize(
    ("half", "above", "speed", "friction"),
    [
        (0.03, 0.0, 0.6, 0.5),
        (0.01, 0.0, 0.6, 0.3),
        (0.01, 0.0, 1.0, 0.5),
        (0.01, 0.02, 0.5, 0.3),
        (0.03, 0.05, 0.5, 0.3),
        (0.02, 0.1, 0.0, 0.5),
    ],
)
def test_it_comes_to_rest_within_a_millimetre(
    mujoco: Any, half: float, above: float, speed: float, friction: float
) -> None:
    """Boxes, thrown along the floor or from `above` it (m): tall fast ones tip over there, and not here."""
    model = mujoco.MjModel.from_xml_string(SCENE.format(friction=friction, z=half + above, half=half))
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    assert abs(data.qvel).max() < 1e-3

    part = Part("box", Box(0.02, 0.02, half), 0.5, friction, 5e4)
    start = Body(part, Transform(IDENTITY.rotation, (0.0, 0.0, half + above)), (speed, 0.0, 0.0), FALLS)
    end = falls(start, grounds_of([FLOOR]))[-1].pose.translation
    assert end == pytest.approx(data.qpos[:3], abs=CLOSE_M)
