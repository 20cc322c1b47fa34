"""The page beside a robot: a viewer sees the robot, and acts on it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import nullcontext
from math import tan
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from iiwa_sim.cell.bodies import BoxSettings
from iiwa_sim.client import Iiwa
from iiwa_sim.protocols.faults import Garble
from iiwa_sim.simulator import Simulator
from iiwa_sim.view.app import PANEL_PX, VIEWS, look_at
from tests.cell.cells import EXAMPLES, GRIPPER
from tests.line_client import DEADLINE_S, wait_until
from tests.view.viewer import Message, Viewer, page_at, place_of, viewing

FAR = ((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)
QUIET_S = 1.0


@pytest.fixture
def robot(simulator: Simulator) -> Iterator[Iiwa]:
    with Iiwa(simulator.host, simulator.port) as robot:
        yield robot


def adds(kind: str, node: str) -> object:
    return lambda message: message["type"] == kind and node in message["name"]


def test_a_viewer_sees_the_robot_move_and_stops_it(simulator: Simulator, viewer: Viewer, robot: Iiwa) -> None:
    robot.joint_move(*FAR)
    turns = "SetOrientationMessage"
    viewer.until(
        lambda each: each["type"] == turns and "/arm/" in each["name"] and each["name"].endswith("link_7")
    )
    viewer.appears("/trail")
    viewer.shows("moving", "mm/s")
    viewer.shows("<td>A1</td><td>-170</td>", "<meter", "<td>170</td>")
    viewer.clicks("Emergency stop")
    viewer.shows("3030 emergency stop")
    viewer.shows("PRESSED")
    assert simulator.state().error.code == 3030
    viewer.clicks("Safety", "Reset error")  # not before it is released
    viewer.until(lambda message: message["type"] == "NotificationShowMessage")
    viewer.clicks("Safety", "Release")
    wait_until(lambda: simulator.state().robot_status[1] == 0)
    viewer.clicks("Safety", "Reset error")
    wait_until(lambda: simulator.state().error.code == 0)
    since = len(viewer.seen)
    simulator.backdoor.place((0.0,) * 7)  # the path of the TCP begins anew
    viewer.until(lambda each: each.get("visible") is False and each["name"].endswith("/trail"), since)


@pytest.mark.parametrize("view", VIEWS)
def test_the_camera_has_arm_and_surroundings_beside_the_panel(view: str) -> None:
    camera = SimpleNamespace(image_width=900, fov=1.0, aspect=9 / 7)
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.2], [0.9, -0.4, 0.1], [0.6, 0.5, 0.4]])
    look_at(SimpleNamespace(camera=camera, atomic=nullcontext), points, view)
    forward = camera.look_at - camera.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    seen = points - camera.position
    half = seen @ forward * tan(0.5 * camera.fov)
    x, y = seen @ right / (half * camera.aspect), seen @ np.cross(right, forward) / half
    assert -1.0 < x.min() < x.max() < 1.0 - 2.0 * PANEL_PX / camera.image_width
    assert -1.0 < y.min() < y.max() < 1.0


def test_the_cell_and_its_contacts_are_drawn(tmp_path: Path) -> None:
    tool = "[tool]\nmass_kg = 1\ncapsules_mm = [[0, 0, 30, 40, 0, 30, 25]]\n"
    (tmp_path / "cell.toml").write_text(
        GRIPPER.replace("[gripper]", f"{tool}[gripper]\njaw_mm = [30, 12, 70]")
    )
    with (
        Simulator(cell=tmp_path / "cell.toml", backdoor_port=0) as simulator,
        page_at(place_of(simulator)) as port,
        viewing(port) as viewer,
    ):

        def box(node: str, *size: float) -> Message:
            return viewer.until(
                lambda message: (
                    message["type"] == "BoxMessage"
                    and node in message["name"]
                    and message["props"]["dimensions"] == pytest.approx(size)
                )
            )

        def is_at(node: str, *place: float) -> None:
            viewer.until(
                lambda message: (
                    message["type"] == "SetPositionMessage"
                    and message["name"] == node
                    and message["position"] == pytest.approx(place, abs=1e-4)
                )
            )

        is_at(box("/bodies/", 0.04, 0.04, 0.06)["name"].removesuffix("/0"), 0.6, 0.0, 0.06)
        viewer.until(lambda each: each["type"] == "CylinderMessage" and "media_126/body/" in each["name"])
        box("/jaws/", 0.03, 0.012, 0.07)
        x_mm, y_mm, z_mm, *_ = simulator.state().tool_frame
        at = {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm - 1e3, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}
        matter = {"stiffness_n_per_m": 1e5, "damping_s_per_m": 0.0, "friction": 0.0}
        simulator.backdoor.add_surface(BoxSettings(name="wall", size_mm=(100, 110, 120), **at, **matter))
        box("/cell/", 0.1, 0.11, 0.12)
        simulator.backdoor.push((30.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        viewer.appears("/tcp/force")


def test_bodies_of_a_scene_are_drawn_and_move() -> None:
    with (
        Simulator(cell=EXAMPLES / "door.toml", backdoor_port=0) as simulator,
        Iiwa(simulator.host, simulator.port) as robot,
        page_at(place_of(simulator)) as port,
        viewing(port) as viewer,
    ):
        panel = viewer.until(
            lambda message: (
                message["type"] == "BoxMessage"
                and message["props"]["dimensions"] == pytest.approx((0.016, 0.42, 0.44))
            )
        )
        assert panel["props"]["color"] == pytest.approx([229, 128, 51], abs=1)
        door = panel["name"].rpartition("/")[0]
        robot.set_output(1, True)
        viewer.until(
            lambda message: (
                message["type"] == "SetPositionMessage"
                and message["name"] == door
                and message["position"][1] > 0.1
            )
        )


def test_the_arm_follows_a_drag_and_returns(simulator: Simulator, viewer: Viewer, robot: Iiwa) -> None:
    robot.start_gravity(300.0)
    viewer.shows("impedance")
    viewer.drags("link_7", "start", 0.6, 0.2, 0.6)
    viewer.drags("link_7", "update", 0.6, 0.3, 0.6)
    viewer.shows("#2f9e44;color:#fff'>FORCE")
    wait_until(lambda: simulator.joints[0] > 0.05)
    assert robot.get_cartesian_force()[:3] != (0.0, 0.0, 0.0)
    viewer.drags("link_7", "end", 0.6, 0.3, 0.6)
    wait_until(lambda: abs(simulator.joints[0]) < 0.01)
    assert robot.get_cartesian_force() == pytest.approx((0.0,) * 6)


def test_a_viewer_that_vanishes_stops_pulling(simulator: Simulator) -> None:
    with page_at(place_of(simulator)) as port:
        with viewing(port) as viewer:
            viewer.shows("stopped")
            viewer.drags("link_3", "start", 0.6, 0.3, 0.6)
            wait_until(lambda: any(simulator.state().joint_torque))
        wait_until(lambda: not any(simulator.state().joint_torque))


def test_the_tabs_switch_and_show(simulator: Simulator, viewer: Viewer, robot: Iiwa) -> None:
    viewer.clicks("Override (%)", 25)
    wait_until(lambda: simulator.state().override == 0.25)
    robot.joint_move(*FAR)
    viewer.clicks("Stop the moves")
    wait_until(lambda: simulator.state().status == "stopped")
    viewer.clicks("Drives", "Off")
    wait_until(lambda: simulator.state().robot_status[2] == 0)
    viewer.clicks("Drives", "On")
    viewer.shows("# switch_drives(on=True)")
    viewer.clicks("Safety", "Reset error")
    wait_until(lambda: simulator.state().robot_status[2] == 1)
    viewer.clicks(simulator.backdoor.cell()["inputs"][2])
    wait_until(lambda: simulator.state().inputs[2])
    robot.set_output(2, True)
    viewer.shows(f"#2f9e44;color:#fff'>{simulator.backdoor.cell()['outputs'][1]}<")
    viewer.clicks("Clock", "10x")
    viewer.shows("Clock: 10x")
    viewer.clicks("Clock", "pause")
    viewer.shows("Clock: 10x paused")
    tick = simulator.state().tick
    viewer.clicks("Advance (s)", "0.1")
    wait_until(lambda: simulator.state().tick == tick + 50)


def test_a_command_is_typed_and_its_garbled_reply_is_in_the_dialogue(
    simulator: Simulator, viewer: Viewer
) -> None:
    viewer.types("Command", "lin move : 1 2")
    viewer.shows("lin move : 1 2", "3040 lin move takes", "#c92a2a")
    simulator.backdoor.set_fault(Garble(), replies=1)
    viewer.types("Command", "get status")
    viewer.shows("~", "stopped")


def test_a_robot_at_rest_costs_a_browser_nothing(simulator: Simulator) -> None:
    def is_quiet() -> bool:
        try:
            viewer.more(QUIET_S)
        except TimeoutError:
            return True
        return False

    with page_at(place_of(simulator)) as port, viewing(port) as viewer:
        viewer.shows("stopped")
        wait_until(is_quiet)


def test_a_robot_that_is_silent_is_reported_and_followed_again(simulator: Simulator) -> None:
    with page_at(place_of(simulator, driver=False)) as port, viewing(port) as viewer:
        viewer.shows("stopped")
        held, goes_on = threading.Event(), threading.Event()

        def hold() -> None:
            held.set()
            goes_on.wait(DEADLINE_S)

        holding = threading.Thread(target=simulator.call, args=(hold,))
        holding.start()
        assert held.wait(DEADLINE_S)
        viewer.shows("timed out")
        goes_on.set()
        holding.join()
        simulator.backdoor.emergency_stop()
        viewer.shows("3030")
