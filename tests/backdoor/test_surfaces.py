"""Surfaces, tools and states that change while the robot is there: what it feels then."""

from __future__ import annotations

import pytest

from iiwa_sim.controller.errors import Refused
from iiwa_sim.protocols.faults import Drop
from tests.asked import joint_move, lin_move, lin_stiff_move
from tests.backdoor.bench import Bench

STIFFNESS = 2e4  # N/m
TOP_MM = 515.0


def above_a_floor() -> Bench:
    bench = Bench()
    assert bench.tell(f"add plane : floor 0 0 {TOP_MM} 0 0 0 {STIFFNESS:g} 0 0") == "done"
    return bench


def force(bench: Bench) -> float:
    """Of the floor: its size is that of the largest component, since the tool stands square to it."""
    return max(bench.controller.cartesian_force()[:3], key=abs)


def goes_down_to(bench: Bench, z_mm: float) -> None:
    here = bench.controller.tool_frame()
    bench.controller.move(lin_move(here._replace(z_mm=z_mm), 0.5, 0.0))
    bench.robot.runs_until_stopped()


def test_a_surface_that_came_later_pushes_back_and_one_that_went_does_not() -> None:
    bench = above_a_floor()
    goes_down_to(bench, TOP_MM - 3.0)
    assert abs(force(bench)) == pytest.approx(STIFFNESS * 3e-3, rel=1e-6)
    assert bench.tell(f"move surface : floor 0 0 {TOP_MM - 3.5} 0 0 0") == "done"
    bench.robot.step()
    assert force(bench) == 0.0
    assert bench.tell(f"move surface : floor 0 0 {TOP_MM - 2.0} 0 0 0").startswith(
        "error 3000 the TCP would be 1.000"
    )
    goes_down_to(bench, TOP_MM - 4.5)
    assert abs(force(bench)) == pytest.approx(STIFFNESS * 1e-3, rel=1e-6)
    assert bench.tell("remove surface : floor") == "done"
    bench.robot.step()
    assert force(bench) == 0.0


def test_a_surface_that_is_moved_while_it_is_touched_goes_on_pushing() -> None:
    bench = Bench()
    assert bench.tell("add box : plate 450 0 515 0 0 0 200 200 2 2e4 0 0") == "done"
    goes_down_to(bench, 513.0)
    assert abs(force(bench)) == pytest.approx(STIFFNESS * 3e-3, rel=1e-6), "below its lower side"
    for middle_mm, deep_mm in ((514.0, 2.0), (513.0, 1.0), (516.0, 4.0), (511.0, 0.0)):
        assert bench.tell(f"move surface : plate 450 0 {middle_mm} 0 0 0") == "done"
        bench.robot.step()
        assert abs(force(bench)) == pytest.approx(1e-3 * deep_mm * STIFFNESS, rel=1e-6)
    told = bench.tell("move surface : plate 450 0 513.5 0 0 0")
    assert told.startswith("error 3000 the TCP would be 0.500")


def test_a_robot_that_yields_feels_it_too() -> None:
    bench = above_a_floor()
    here = bench.controller.tool_frame()
    bench.controller.move(lin_stiff_move(here._replace(z_mm=TOP_MM - 10.0), 0.2, 2000.0, (0.0,) * 6))
    bench.robot.step(3000)
    deep_mm = TOP_MM - bench.controller.tool_frame().z_mm
    assert deep_mm == pytest.approx(10.0 * 2000.0 / (2000.0 + STIFFNESS), rel=0.02), "two springs in a row"


def test_a_robot_that_yields_does_so_at_its_new_tool() -> None:
    bench = Bench()
    assert bench.tell("set tool : 0 0 300 0 0 0") == "done"
    assert bench.tell("push : 0 0 20 0 0 0") == "done"
    here = bench.controller.tool_frame()
    bench.controller.move(lin_stiff_move(here, 0.2, 2000.0, (0.0,) * 6))
    bench.robot.step(3000)
    there = bench.controller.tool_frame()
    gone_mm = [a - b for a, b in zip(there[:3], here[:3], strict=True)]
    assert sum(gap * gap for gap in gone_mm) ** 0.5 == pytest.approx(1e3 * 20.0 / 2000.0, rel=0.02)


def test_neither_place_nor_tool_bring_the_tcp_within_a_surface() -> None:
    bench = above_a_floor()
    goes_down_to(bench, TOP_MM + 1.0)
    before = bench.seen()
    assert bench.tell("set tool : 150 0 60 0 1.5708 0").startswith("error 3000 the TCP would be 19.")
    assert bench.tell("place : 0 0.7 0 -1.0472 0 1.5708 0").startswith("error 3000 the TCP would be ")
    assert bench.seen() == before


def test_a_state_comes_back_as_it_was() -> None:
    bench = above_a_floor()
    for line in ("set tool : 1 2 30 0 0.1 0", "push : 1 2 3 0 0 0", "set input : 4 1", "save state : mine"):
        assert bench.tell(line) == "done"
    bench.controller.set_override(0.25)
    assert bench.tell("save state : slow") == "done"
    kept = bench.seen()
    assert bench.tell("restore state : start") == "done"
    assert bench.backdoor.surfaces() == []
    assert bench.controller.override == 1.0
    assert bench.controller.tool_in_flange == bench.robot.description.tool_in_flange
    bench.controller.move(joint_move([0.0, 0.4, 0.0, -1.2, 0.0, 1.5, 0.0], [1.0] * 7))
    bench.robot.step(100)
    bench.controller.emergency_stop()
    bench.robot.runs_until_stopped(0.1)
    assert bench.tell("drives off") == "done"
    assert bench.tell("restore state : slow") == "done"
    now = bench.seen()
    assert now["surfaces"] == kept["surfaces"]
    assert now["push"] == kept["push"]
    assert now["tool"] == kept["tool"]
    state, was = bench.backdoor.state(), kept["state"]
    for field in ("joint_position", "tool_frame", "override", "inputs", "outputs", "robot_status", "error"):
        assert getattr(state, field) == getattr(was, field), field
    assert state.mode == "unknown"


def test_what_is_no_fault_is_refused_with_what_was_expected() -> None:
    bench = Bench()
    told = r"expected one of Pass\(\), Delay\(seconds\), Split\(byte, pause_s\), Drop"
    with pytest.raises(Refused, match=told):
        bench.backdoor.set_fault("drop")
    bench.backdoor.set_fault(Drop())
