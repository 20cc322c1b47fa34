"""What a viewer does on the pendant, and what becomes of it; what is drawn."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.simulator import Simulator
from iiwa_sim.view.trail import colour_of
from tests.talking import DEADLINE_S, wait_until
from tests.view.test_live import FAR, page_of, shows, types
from tests.view.viewer import Message, Viewer, viewing

QUIET_S = 1.0


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator(status_port=0, backdoor_port=0) as simulator:
        yield simulator


def appears(viewer: Viewer, name: str) -> None:
    """A node of the scene that ends so becomes visible."""
    viewer.until(
        lambda message: (
            message["type"] == "SetSceneNodeVisibilityMessage"
            and message["name"].endswith(name)
            and message["visible"]
        )
    )


def test_override_drives_inputs_and_outputs(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer, Iiwa(simulator.host, simulator.port) as robot:
        viewer.clicks("Override", 0.25)
        wait_until(lambda: simulator.state().override == 0.25)
        viewer.clicks("Drives", "Off")
        shows(viewer, "drives", "off</span>")
        viewer.clicks("Drives", "On")
        shows(viewer, "page # drives on")
        viewer.clicks("Safety", "Reset error")
        wait_until(lambda: simulator.state().robot_status[2] == 1)
        viewer.clicks(simulator.backdoor.cell().inputs[2])
        wait_until(lambda: simulator.state().inputs[2])
        robot.set_output(2, True)
        lit = f'#2f9e44;color:#fff">{simulator.backdoor.cell().outputs[1]}<'
        shows(viewer, lit)


def test_clock_and_steps(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer:
        viewer.clicks("Pace", "10x")
        shows(viewer, "Clock: 10x")
        viewer.clicks("Time", "Pause")
        shows(viewer, "Clock: 10x paused")
        viewer.clicks("Pace", "stepped")
        viewer.clicks("Time", "Resume")
        wait_until(lambda: simulator.call(lambda: simulator.clock.told) == "stepped")
        tick = simulator.state().tick
        viewer.clicks("Step (s)", 0.2)
        viewer.clicks("Step")
        wait_until(lambda: simulator.state().tick == tick + 100)


def test_a_state_is_kept_and_the_robot_put_there_again(simulator: Simulator) -> None:
    simulator.set_clock("fast")
    with page_of(simulator) as port, viewing(port) as viewer, Iiwa(simulator.host, simulator.port) as robot:
        types(viewer, "Keep as", "there")
        viewer.until(lambda message: "there" in message.get("updates", {}).get("options", ()))
        before = simulator.joints
        robot.joint_move((0.5, 0.5, 0.0, -1.0, 0.0, 1.2, 0.0), (1.0,) * 7)
        robot.wait_until_stopped(timeout_s=DEADLINE_S)
        assert simulator.joints != before
        viewer.clicks("State", "there")
        viewer.clicks("Restore")
        wait_until(lambda: simulator.joints == before)


def test_goal_force_and_path_are_drawn(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer, Iiwa(simulator.host, simulator.port) as robot:
        shows(viewer, "stopped")
        robot.joint_move(*FAR)
        appears(viewer, "/goal")
        appears(viewer, "/trail/0")
        simulator.backdoor.push((30.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        appears(viewer, "/tcp/force")


def test_the_path_is_coloured_by_speed() -> None:
    assert colour_of(0.0) == (60, 90, 220)
    assert colour_of(1.0) == colour_of(7.0) == (220, 40, 40)
    blue, red = np.array([colour_of(speed)[::2] for speed in np.linspace(0.0, 1.0, 50)]).T[::-1]
    assert np.argmax(blue) == 0
    assert np.argmax(red) > 25


def test_a_robot_at_rest_sends_nothing(simulator: Simulator) -> None:
    """Once all is drawn there comes a second without any message; the robot goes on telling its state."""
    with page_of(simulator) as port, viewing(port) as viewer:
        shows(viewer, "stopped")
        came: list[Message] = []

        def quiet() -> bool:
            try:
                came.extend(viewer._more(QUIET_S))
            except TimeoutError:
                return True
            return False

        tick = simulator.state().tick
        wait_until(quiet)
        assert simulator.state().tick > tick, "the page is connected, so the robot ticks"
