"""The example cell with a conveyor and a light barrier, over real sockets."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from iiwa_sim import Iiwa, Simulator

EXAMPLES = Path(__file__).parent.parent / "examples"


def program(name: str) -> ModuleType:
    """An example, as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_block_is_picked_from_the_moving_belt() -> None:
    conveyor = program("13_conveyor")
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
    program("13_conveyor").main()
    told = capsys.readouterr().out.splitlines()
    assert [line.partition(" at ")[0] for line in told] == [f"block {number} lies" for number in (1, 2, 3)]
