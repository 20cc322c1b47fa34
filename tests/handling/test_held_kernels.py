"""What is held: compiled as interpreted, bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, compose, transform_from_euler
from iiwa_sim.handling import fingers_kernel, held_kernel
from iiwa_sim.handling.gripper import Gripper, Jaws
from iiwa_sim.handling.part import Part
from tests.interpreted import interpreted
from tests.samples import some

TICK_S = 0.005
PLAIN = interpreted("iiwa_sim.handling.held_kernel")
PLAIN_FINGERS = interpreted("iiwa_sim.handling.fingers_kernel")
JAWS = Jaws(stroke_m=0.2, speed_m_per_s=0.1, force_n=30.0, pad_wide_m=0.05, pad_long_m=0.05)
PARTS: list[Box | Cylinder | Sphere] = [Box(0.05, 0.03, 0.02), Sphere(0.03), Cylinder(0.02, 0.04)]
OBSTACLES: list[Shape] = [Plane(), Box(0.05, 0.06, 0.02), Sphere(0.05), Cylinder(0.04, 0.03)]
few = settings(max_examples=some(25), deadline=None)
part = st.floats(-1.0, 1.0)
parts = st.lists(part, min_size=6, max_size=6)


def at(numbers: Sequence[float], way_m: float, angle: float = 1.0) -> Transform:
    x, y, z, a, b, c = numbers
    return transform_from_euler(way_m * x, way_m * y, way_m * z, angle * a, angle * b, angle * c)


def run(kernel: ModuleType, shape: Shape, obstacle: Shape, ways: list[list[float]]) -> list[object]:
    """What a part does to the TCP, and where it is, on a way through something that it touches."""
    it = Part("it", shape, 0.5, 0.4, 2e4)  # type: ignore[arg-type]
    surface = Surface("other", obstacle, at(ways[0], 0.02), 2e4, 0.0, 0.4)
    tcp = at(ways[1], 0.06, 0.1)
    held = kernel.Held(it, at(ways[2], 0.005, 0.3), tcp, Gripper(JAWS), TICK_S)
    seen: list[object] = []
    for way in ways[3:]:
        for _ in range(4):
            coming = compose(tcp, at(way, 0.004, 0.02))
            holds = held.step(tcp, coming if way[0] > 0.0 else None, lambda: [surface])
            seen.append((holds, held.wrench, held.weight, held.pose, held.velocity, held.slip))
            seen.append((held.touching.force, held.touching.torque, held.quiet))
            tcp = coming
    kept = held.felt()
    held.rest(tcp, lambda: [surface])
    held.feel_again(kept)
    seen.append((held.wrench, held.way_since(at(ways[0], 0.1), held.in_tcp, tcp)))
    return seen


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=lambda shape: type(shape).__name__)
@few
@given(shape=st.sampled_from(PARTS), ways=st.lists(parts, min_size=5, max_size=12))
def test_a_part_that_is_carried_and_pressed_on_something(
    obstacle: Shape, shape: Shape, ways: list[list[float]]
) -> None:
    assert run(held_kernel, shape, obstacle, ways) == run(PLAIN, shape, obstacle, ways)


@few
@given(opening=st.floats(0.0, 0.2), tool=parts, radius=st.sampled_from([0.0, 0.01]))
def test_jaws(opening: float, tool: list[float], radius: float) -> None:
    at_tool = at(tool, 0.2)
    compiled, plain = (
        module.Fingers(JAWS, at_tool, radius).at(opening) for module in (fingers_kernel, PLAIN_FINGERS)
    )
    assert compiled == plain
