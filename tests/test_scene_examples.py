"""The example cells with a scene over real sockets: a conveyor with a light barrier, a door."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import pytest

from iiwa_sim import CommandError, Iiwa, Simulator
from iiwa_sim.controller.state import Snapshot

EXAMPLES = Path(__file__).parent.parent / "examples"


def program(name: str) -> ModuleType:
    """An example, as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@contextmanager
def driven(cell: Path, clock: str) -> Iterator[tuple[Simulator, Iiwa, Callable[[float], None]]]:
    """A robot in a cell and its driver, which lets time pass as it waits."""
    with Simulator(cell=cell, clock="stepped") as simulator, Iiwa("127.0.0.1", simulator.port) as robot:
        simulator.pause()
        simulator.backdoor.set_clock(clock)
        yield simulator, robot, simulator.advance


def test_a_block_is_picked_from_the_moving_belt_the_same_to_the_last_bit_on_both_clocks() -> None:
    conveyor = program("13_conveyor")
    states: list[Snapshot] = []
    for clock in ("stepped", "fast"):
        with driven(conveyor.CELL, clock) as (simulator, robot, wait):
            conveyor.pick(robot, wait)
            held = simulator.state()
            assert [part.state for part in held.parts] == ["held", "lies", "lies"]
            assert held.parts[0].frame[:2] == pytest.approx((500.0, 0.0), abs=2.0)
            assert held.inputs[conveyor.HOLDS - 1]
            assert not held.inputs[conveyor.SEEN - 1]
            conveyor.moved(robot, wait, 500, 0, 512)
            conveyor.place(robot, wait, 0)
            states.append(simulator.state())
    assert states[0] == states[1]
    assert states[0].parts[0].state == "lies"
    assert states[0].parts[0].frame[:3] == pytest.approx((398.0, 350.0, 320.0), abs=3.0), "in the tray"


def test_the_arm_goes_in_where_the_door_is_open_and_stops_at_a_closed_one() -> None:
    door = program("14_door")
    with driven(door.CELL, "fast") as (simulator, robot, wait):
        robot.ptp_move((*door.OUTSIDE, *door.AHEAD), speed=0.5, blending=0)
        simulator.run_until_stopped(10)
        robot.set_output(door.OPEN, value=True)
        wait(0.5)
        assert simulator.state().inputs[:2] == (False, False), "neither open nor closed"
        door.reach_in(robot, wait)
        wait(3)
        assert simulator.state().inputs[:2] == (False, True)
        with pytest.raises(CommandError, match=r"the sphere round the TCP touches body 'door'"):
            door.reach_in(robot, wait, looks=False)
        state = simulator.state()
    assert state.error.code == 3060
    assert 702.0 < state.tool_frame.x_mm < 712.0, "its sphere is at the door"


@pytest.mark.slow
def test_three_blocks_are_picked(capsys: pytest.CaptureFixture[str]) -> None:
    program("13_conveyor").main()
    told = capsys.readouterr().out.splitlines()
    assert [line.partition(" at ")[0] for line in told] == [f"block {number} lies" for number in (1, 2, 3)]
