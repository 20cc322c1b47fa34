"""Examples that handle parts, over real sockets: boxes packed, and blocks picked from a moving belt."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from types import ModuleType

import pytest

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.controller.state import Snapshot

EXAMPLES = Path(__file__).parent.parent / "examples"


def example(name: str) -> ModuleType:
    """Return an example, as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def program() -> ModuleType:
    return example("palletising")


def waiting(simulator: Simulator, clock: str) -> Callable[[float], None]:
    """Return a wait for the program: on a stepped clock it advances the time."""
    return simulator.advance if clock == "stepped" else lambda _: None


def packed(
    program: ModuleType, clock: str, count: int, recording: Path | None = None
) -> tuple[list[float], Snapshot]:
    """Pack some of the boxes; return the heights of their contacts, and the state then.

    A recording sees every tick, so none of them are made at once.
    """
    with Simulator(cell=program.CELL, clock=clock) as simulator, Iiwa("127.0.0.1", simulator.port) as robot:
        wait, heights = waiting(simulator, clock), []
        if recording is not None:
            simulator.record(recording, rate_hz=1)
        for start, end in islice(zip(program.FROM, program.TO, strict=True), count):
            program.pick(robot, *start, wait=wait)
            heights.append(program.put(robot, *end, wait=wait))
        return heights, simulator.state()


def places(state: Snapshot) -> list[object]:
    return [(part.name, part.frame, part.state) for part in state.parts]


def test_boxes_are_the_same_to_the_last_bit_on_both_clocks(program: ModuleType, tmp_path: Path) -> None:
    heights, state = packed(program, "fast", 1)
    again, stepped = packed(program, "stepped", 1, tmp_path / "ticks.mcap")
    assert heights == again
    assert places(state) == places(stepped)
    assert state.joint_position == stepped.joint_position
    assert [part.state for part in state.parts] == ["lies"] * 24
    for (x_mm, y_mm), part in zip(program.TO, state.parts[:1], strict=False):
        assert part.frame[:3] == pytest.approx((x_mm, y_mm, 315.0), abs=0.1)


@pytest.mark.slow
def test_all_24_boxes_lie_in_two_layers_each_time_the_same(program: ModuleType) -> None:
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
        assert robot.get_cartesian_force() == pytest.approx((0.0,) * 6, abs=0.01)  # the load is set
        simulator.backdoor.lose_part()
        simulator.advance(1.0)
        assert robot.get_cartesian_force().fz < -1.5  # the controller still believes in it
        with pytest.raises(program.PartLost, match="lost on its way"):
            program.put(robot, *program.TO[0], wait=wait)


def test_a_block_is_picked_from_the_moving_belt() -> None:
    conveyor = example("13_conveyor")
    with (
        Simulator(cell=conveyor.CELL, clock="stepped") as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        wait = simulator.advance
        conveyor.pick(robot, wait)
        held = simulator.state()
        assert [part.state for part in held.parts] == ["held", "lies", "lies"]
        assert held.parts[0].frame[:2] == pytest.approx((500.0, 0.0), abs=2.0)
        assert held.inputs[conveyor.HOLDS - 1]
        assert not held.inputs[conveyor.SEEN - 1]
        conveyor.moved(robot, wait, 500, 0, 512)
        conveyor.place(robot, wait, 0)
        part = simulator.state().parts[0]
    assert part.state == "lies"
    assert part.frame[:3] == pytest.approx((398.0, 350.0, 320.0), abs=3.0), "in the tray"


@pytest.mark.slow
def test_three_blocks_are_picked(capsys: pytest.CaptureFixture[str]) -> None:
    example("13_conveyor").main()
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(" at ")[0] for line in lines] == [f"block {number} lies" for number in (1, 2, 3)]
