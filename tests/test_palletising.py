"""examples/palletising.py over a real socket: packed, the same on every clock, and a lost box noticed."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from types import ModuleType

import pytest

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.controller.state import Snapshot

EXAMPLE = Path(__file__).parent.parent / "examples" / "palletising.py"


@pytest.fixture(scope="module")
def program() -> ModuleType:
    """The example, as a module."""
    spec = importlib.util.spec_from_file_location("palletising", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def waiting(simulator: Simulator, clock: str) -> Callable[[float], None]:
    """How the program waits: on a stepped clock, by letting time pass."""
    return simulator.advance if clock == "stepped" else lambda _: None


def packed(program: ModuleType, clock: str, count: int) -> tuple[list[float], Snapshot]:
    """Some of the boxes, packed: heights at which they were felt, and the state then."""
    with Simulator(cell=program.CELL, clock=clock) as simulator, Iiwa("127.0.0.1", simulator.port) as robot:
        wait, heights = waiting(simulator, clock), []
        for start, end in islice(zip(program.FROM, program.TO, strict=True), count):
            program.pick(robot, *start, wait=wait)
            heights.append(program.put(robot, *end, wait=wait))
        return heights, simulator.state()


def places(state: Snapshot) -> list[object]:
    return [(part.name, part.frame, part.state) for part in state.parts]


def test_boxes_are_the_same_to_the_last_bit_on_both_clocks(program: ModuleType) -> None:
    heights, state = packed(program, "fast", 1)
    again, stepped = packed(program, "stepped", 1)
    assert heights == again
    assert places(state) == places(stepped)
    assert state.joint_position == stepped.joint_position
    assert [part.state for part in state.parts] == ["lies"] * 24
    for (x_mm, y_mm), part in zip(program.TO, state.parts[:1], strict=False):
        assert part.frame[:3] == pytest.approx((x_mm, y_mm, 315.0), abs=0.1)


@pytest.mark.slow
def test_all_24_in_two_layers_each_time_the_same(program: ModuleType) -> None:
    first, state = packed(program, "fast", 24)
    lower, upper = (
        [part.frame.z_mm for part in state.parts[:12]],
        [part.frame.z_mm for part in state.parts[12:]],
    )
    assert lower == pytest.approx([315.0] * 12, abs=0.15)  # under the weight of two boxes
    assert upper == pytest.approx([345.0] * 12, abs=0.2)
    for clock in ("fast", "stepped"):
        heights, again = packed(program, clock, 24)
        assert heights == first
        assert places(again) == places(state)


def test_a_box_that_is_lost_or_missing_is_noticed(program: ModuleType) -> None:
    with (
        Simulator(cell=program.CELL, clock="stepped") as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        wait = waiting(simulator, "stepped")
        simulator.backdoor.remove_part("box 1")
        with pytest.raises(program.PartLost, match="there is no box at 400 -350"):
            program.pick(robot, *program.FROM[0], wait=wait)
        robot.set_output(program.CLOSE, False)
        program.wait_for(robot, program.OPEN, wait=wait)
        program.pick(robot, *program.FROM[1], wait=wait)
        assert robot.get_cartesian_force() == pytest.approx((0.0,) * 6, abs=0.01)  # the load was told
        simulator.backdoor.lose_part()
        simulator.advance(1.0)
        assert robot.get_cartesian_force().fz < -1.5  # the controller still believes in it
        with pytest.raises(program.PartLost, match="lost on its way"):
            program.put(robot, *program.TO[0], wait=wait)
