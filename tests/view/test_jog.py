"""Jogging on the page: steps, a button that is held, and the ends of a motion."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from math import radians

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.simulator import Simulator
from tests.line_client import wait_until
from tests.view.viewer import Viewer

PERIOD_S = 0.05
"""Period of messages of a browser while a button is held."""


def button(viewer: Viewer, sign: str) -> str:
    """Return the id of a button, whose label follows the axis."""
    found = viewer.until(lambda each: str(each.get("props", {}).get("label")).startswith(f"{sign}  "))
    return str(found["uuid"])


def tap(viewer: Viewer, sign: str) -> None:
    uuid = button(viewer, sign)
    viewer.send(type="GuiButtonHoldMessage", uuid=uuid, frequency=20.0)
    viewer.send(type="GuiUpdateMessage", uuid=uuid, updates={"value": True})


def hold_until(viewer: Viewer, sign: str, is_there: Callable[[], bool]) -> None:
    """Hold a button as a browser does, until something has happened; read what the page shows meanwhile."""
    uuid = button(viewer, sign)

    def holds() -> bool:
        viewer.send(type="GuiButtonHoldMessage", uuid=uuid, frequency=20.0)
        with suppress(TimeoutError):
            viewer.more(PERIOD_S)
        return is_there()

    wait_until(holds)


def test_a_tap_makes_one_step_and_needs_the_switch(simulator: Simulator, viewer: Viewer) -> None:
    before = simulator.joints
    tap(viewer, "+")
    viewer.shows("tick Enable first")
    viewer.clicks("Enable")
    viewer.clicks("Axis", "A2")
    viewer.clicks("Step", "5")
    viewer.shows("A2  (tap: 5 deg)")
    tap(viewer, "-")
    tap(viewer, "-")
    wait_until(lambda: simulator.joints[1] == pytest.approx(before[1] - radians(10.0), abs=1e-4))
    assert simulator.joints[0] == before[0]


def test_a_held_button_moves_until_its_release(simulator: Simulator, viewer: Viewer) -> None:
    viewer.clicks("Enable")
    viewer.clicks("Speed (%)", 30)
    hold_until(viewer, "+", lambda: simulator.joints[0] > 0.2)
    viewer.send(type="GuiUpdateMessage", uuid=button(viewer, "+"), updates={"value": True})
    wait_until(lambda: simulator.state().status == "stopped")
    assert simulator.joints[0] < 1.0


def test_a_line_is_jogged_straight(simulator: Simulator, viewer: Viewer) -> None:
    before = simulator.state().tool_frame
    viewer.clicks("Enable")
    viewer.clicks("Frame", "Tool")
    viewer.shows("X of the tool  (tap: 1 mm)")
    hold_until(viewer, "-", lambda: simulator.state().tool_frame[2] < before[2] - 30.0)
    wait_until(lambda: simulator.state().status == "stopped")
    assert simulator.state().tool_frame[:2] == pytest.approx(before[:2], abs=0.2)


@pytest.mark.parametrize(
    ("axis", "turn"),
    [
        pytest.param("Rx", Frame(0, 0, 0, 0, 0, radians(5)), marks=pytest.mark.slow),
        ("Rz", Frame(0, 0, 0, radians(5), 0, 0)),
    ],
)
def test_a_step_turns_the_tcp_about_an_axis(
    simulator: Simulator, viewer: Viewer, axis: str, turn: Frame
) -> None:
    def tcp() -> Transform:
        return simulator.state().tool_frame.to_transform()

    simulator.backdoor.place((0.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0))
    goal = compose(tcp(), turn.to_transform())
    viewer.clicks("Enable")
    viewer.clicks("Frame", "Tool")
    viewer.shows("X of the tool  (tap: 1 mm)")
    viewer.clicks("Axis", axis)
    viewer.clicks("Step", "5")
    viewer.shows(f"{axis} of the tool  (tap: 5 deg)")
    tap(viewer, "+")
    wait_until(lambda: tcp().rotation == pytest.approx(goal.rotation, abs=1e-4))
    assert tcp().translation == pytest.approx(goal.translation, abs=1e-4)


def test_a_silent_browser_stops_the_robot_and_clears_the_switch(simulator: Simulator, viewer: Viewer) -> None:
    viewer.clicks("Enable")
    hold_until(viewer, "+", lambda: simulator.state().status == "moving")
    wait_until(lambda: simulator.state().status == "stopped")
    enable = viewer.labelled("Enable")
    viewer.until(lambda each: each.get("uuid") == enable and each.get("updates") == {"value": False})
    viewer.shows("the browser was silent for 0.25 s")
    stopped = simulator.joints
    for _ in range(10):  # it thaws with the button down
        viewer.send(type="GuiButtonHoldMessage", uuid=button(viewer, "+"), frequency=20.0)
    tap(viewer, "+")
    viewer.shows("tick Enable first")
    assert simulator.joints == stopped


def test_a_joint_stops_before_its_limit(simulator: Simulator, viewer: Viewer) -> None:
    limit = simulator.cell.description.position_max[0]
    simulator.backdoor.place((limit - 0.05, *simulator.joints[1:]))
    viewer.clicks("Enable")
    hold_until(viewer, "+", lambda: limit - 0.001 < simulator.joints[0])
    wait_until(lambda: simulator.state().status == "stopped")
    assert simulator.joints[0] < limit
    assert simulator.state().error.code == 0


def test_jogging_is_rejected_while_another_client_moves(simulator: Simulator, viewer: Viewer) -> None:
    with Iiwa(simulator.host, simulator.port) as robot:
        robot.joint_move((1, 1, 1, -1.5, 1, 1, 1), (0.05,) * 7)
        viewer.clicks("Enable")
        enable = viewer.labelled("Enable")
        since = len(viewer.seen)
        reason = "another client moves the robot"
        hold_until(viewer, "+", lambda: any(reason in str(each) for each in viewer.seen[since:]))
        viewer.until(lambda each: each.get("uuid") == enable and each.get("updates") == {"value": False})
        assert robot.get_status() == "moving"
