"""Forces after changes of surfaces, tools and saved states."""

from __future__ import annotations

import pytest

from iiwa_sim.cell.bodies import PlaneSettings
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from tests.backdoor.bench import Bench
from tests.requests import joint_move, lin_move

STIFFNESS = 2e4  # N/m
TOP_MM = 515.0


def above_a_floor() -> Bench:
    bench = Bench()
    bench.backdoor.add_surface(PlaneSettings(name="floor", z_mm=TOP_MM, stiffness_n_per_m=STIFFNESS))
    return bench


def at(z_mm: float, x_mm: float = 0.0) -> Frame:
    return Frame(x_mm, 0, z_mm, 0, 0, 0)


def force(bench: Bench) -> float:
    """Return the force of the floor (N): the largest component, since the tool stands square to it."""
    return max(bench.controller.cartesian_force()[:3], key=abs)


def goes_down_to(bench: Bench, z_mm: float) -> None:
    here = bench.controller.tool_frame()
    bench.controller.move(lin_move(here._replace(z_mm=z_mm), 0.5, 0.0))
    bench.robot.runs_until_stopped()


def test_an_added_surface_pushes_back_and_a_removed_one_does_not() -> None:
    bench = above_a_floor()
    goes_down_to(bench, TOP_MM - 3.0)
    assert abs(force(bench)) == pytest.approx(STIFFNESS * 3e-3, rel=1e-6)
    bench.backdoor.move_surface("floor", at(TOP_MM - 3.5))
    bench.robot.step()
    assert force(bench) == 0.0
    with pytest.raises(Refused, match="the TCP would be 1"):
        bench.backdoor.move_surface("floor", at(TOP_MM - 2.0))
    goes_down_to(bench, TOP_MM - 4.5)
    assert abs(force(bench)) == pytest.approx(STIFFNESS * 1e-3, rel=1e-6)
    bench.backdoor.remove_surface("floor")
    bench.robot.step()
    assert force(bench) == 0.0


def test_a_saved_state_is_restored_exactly() -> None:
    bench = above_a_floor()
    bench.backdoor.set_tool(Frame(1, 2, 30, 0, 0.1, 0))
    bench.backdoor.push((1, 2, 3, 0, 0, 0))
    bench.backdoor.set_input(4, on=True)
    bench.controller.set_override(0.25)
    bench.backdoor.save_state("slow")
    kept = bench.seen()
    bench.backdoor.restore_state("start")
    assert bench.backdoor.cell()["surfaces"] == []
    assert bench.controller.override == 1.0
    assert bench.controller.tool_in_flange == bench.robot.description.tool_in_flange
    bench.controller.move(joint_move([0.0, 0.4, 0.0, -1.2, 0.0, 1.5, 0.0], [1.0] * 7))
    bench.robot.step(100)
    bench.controller.emergency_stop()
    bench.robot.runs_until_stopped(0.1)
    bench.backdoor.switch_drives(on=False)
    bench.backdoor.restore_state("slow")
    now = bench.seen()
    assert now["surfaces"] == kept["surfaces"]
    assert now["push"] == kept["push"]
    assert now["tool"] == kept["tool"]
    state, was = bench.backdoor.state(), kept["state"]
    for field in ("joint_position", "tool_frame", "override", "inputs", "outputs", "robot_status", "error"):
        assert getattr(state, field) == getattr(was, field), field
    assert state.mode == "unknown"
