"""The whole page beside a robot: what a viewer sees of it, and what it does to it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.cell.surfaces import BoxSettings
from iiwa_sim.client import Iiwa
from iiwa_sim.protocols.faults import Garble
from iiwa_sim.simulator import Simulator
from iiwa_sim.view.live import run_page
from iiwa_sim.view.station import Place, Station, StationFault
from tests.cell.cells import GRIPPER
from tests.talking import DEADLINE_S, wait_until
from tests.view.viewer import Message, Viewer, viewing

FAR = ((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)


def place_of(simulator: Simulator, backdoor: bool = True, name: str = "") -> Place:
    assert simulator.status_port is not None
    assert simulator.backdoor_port is not None
    return Place(
        name=name,
        status=("127.0.0.1", simulator.status_port),
        backdoor=("127.0.0.1", simulator.backdoor_port) if backdoor else None,
        driver=("127.0.0.1", simulator.port),
    )


@contextmanager
def page_of(simulator: Simulator, backdoor: bool = True) -> Iterator[int]:
    """The port of a page that shows it."""
    with page_at(place_of(simulator, backdoor)) as port:
        yield port


@contextmanager
def page_at(*places: Place) -> Iterator[int]:
    """The port of a page that shows robots."""
    over, opened = threading.Event(), threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        page = threading.Thread(target=run_page, args=(listening, places, over, None, opened.set))
        page.start()
        try:
            assert opened.wait(DEADLINE_S)
            yield listening.getsockname()[1]
        finally:
            over.set()
            page.join(DEADLINE_S)
            assert not page.is_alive()


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator(status_port=0, backdoor_port=0) as simulator:
        yield simulator


def turns(joint: str) -> object:
    """Whether a message turns this joint of the arm."""

    def found(message: Message) -> bool:
        name = str(message.get("name", ""))
        return message["type"] == "SetOrientationMessage" and "/arm/" in name and name.endswith(joint)

    return found


def shows(viewer: Viewer, *texts: str) -> None:
    """It is told all of these at once, in what is written beside the picture."""
    viewer.until(
        lambda message: all(text in str(message.get("updates", {}).get("content")) for text in texts)
    )


def test_a_viewer_sees_the_robot_move_and_stops_it(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer, Iiwa(simulator.host, simulator.port) as robot:
        shows(viewer, "stopped", "A7", "450.00")
        robot.joint_move(*FAR)
        viewer.until(turns("link_7"))
        shows(viewer, "moving")
        viewer.clicks("Emergency stop")
        shows(viewer, "pressed", "3030 emergency stop")
        assert simulator.state().error.code == 3030
        viewer.clicks("Safety", "Reset error")  # not before it is released
        viewer.until(
            lambda message: message["type"] == "NotificationShowMessage" or "Refused" in str(message)
        )
        viewer.clicks("Safety", "Release")
        viewer.clicks("Safety", "Reset error")
        shows(viewer, "released", "none")
        viewer.clicks("Safety", "Release")  # so the dialogue is told once more
        shows(viewer, "page # emergency stop", "page # reset error (", "page # release emergency stop")


def marks_a_contact(message: Message) -> bool:
    return (
        message["type"] == "SetSceneNodeVisibilityMessage"
        and message["name"].endswith("/contact/0")
        and message["visible"]
    )


def test_surfaces_and_contacts_are_drawn(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer:
        shows(viewer, "stopped")
        x_mm, y_mm, z_mm = simulator.state().tool_frame[:3]
        simulator.backdoor.add_surface(
            BoxSettings(
                name="block",
                x_mm=x_mm,
                y_mm=y_mm,
                z_mm=z_mm - 50.0001,
                size_mm=(100, 100, 100),
                stiffness_n_per_m=1e5,
            )
        )
        viewer.until(lambda message: message["type"] == "BoxMessage" and "/cell/" in message["name"])
        viewer.until(marks_a_contact)


def test_a_gripper_and_parts_are_drawn_and_told(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(GRIPPER.replace("[gripper]", "[gripper]\njaw_mm = [30, 12, 70]"))
    with (
        Simulator(cell=tmp_path / "cell.toml", status_port=0, backdoor_port=0) as simulator,
        page_of(simulator) as port,
        viewing(port) as viewer,
    ):
        block = viewer.until(lambda message: message["type"] == "BoxMessage" and "/parts/" in message["name"])
        assert block["props"]["dimensions"] == pytest.approx((0.04, 0.04, 0.06))
        viewer.until(
            lambda message: (
                message["type"] == "SetPositionMessage"
                and message["name"] == block["name"]
                and message["position"] == pytest.approx((0.6, 0.0, 0.06), abs=1e-4)
            )
        )
        simulator.call(lambda: simulator.controller.io.set_output(1, True))
        simulator.backdoor.set_input(1, False)  # so the robot is looked at again
        viewer.until(
            lambda message: (
                message["type"] == "SetPositionMessage"
                and message["name"].endswith("/tcp/jaw_2")
                and message["position"] == pytest.approx((0.0, -0.006, -0.035), abs=1e-4)
            )
        )
        jaws = {
            message["name"]: message["props"]["dimensions"]
            for message in viewer.seen
            if message["type"] == "BoxMessage" and "/jaw_" in message["name"]
        }
        assert list(jaws.values()) == [pytest.approx((0.03, 0.012, 0.07))] * 2, "the newest ones"


def test_the_tool_is_a_body_at_the_flange(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text("[tool]\nmass_kg = 1\ncapsules_mm = [[0, 0, 30, 40, 0, 30, 25]]\n")
    with (
        Simulator(cell=tmp_path / "cell.toml", status_port=0, backdoor_port=0) as simulator,
        page_of(simulator) as port,
        viewing(port) as viewer,
    ):
        node = f"/{simulator.cell.description.flange}/tool_body"
        viewer.until(lambda message: message["type"] == "MeshMessage" and message["name"].endswith(node))


def test_the_arm_yields_to_a_drag_and_comes_back(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer, Iiwa(simulator.host, simulator.port) as robot:
        shows(viewer, "stopped")
        robot.start_gravity(300.0)
        shows(viewer, "impedance")
        viewer.drags("link_7", "start", 0.6, 0.2, 0.6)
        viewer.drags("link_7", "update", 0.6, 0.3, 0.6)
        viewer.until(lambda message: str(message.get("updates", {}).get("text", "")).endswith(" N"))
        wait_until(lambda: simulator.joints[0] > 0.05)
        assert robot.get_cartesian_force()[:3] != (0.0, 0.0, 0.0)
        viewer.drags("link_7", "end", 0.6, 0.3, 0.6)
        wait_until(lambda: abs(simulator.joints[0]) < 0.01)
        assert robot.get_cartesian_force() == pytest.approx((0.0,) * 6)


def test_a_force_move_ends_where_it_is_dragged(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer, Iiwa(simulator.host, simulator.port) as robot:
        shows(viewer, "stopped")
        here = robot.get_tool_frame()
        target = (*here[:2], here[2] - 200.0, *here[3:])
        robot.linforce_move(target, 0.001, 0.0, 20.0, 20.0, 20.0)  # for a minute, if nothing ends it
        shows(viewer, "normal", "moving")
        viewer.drags("link_7", "start", 0.6, 0.0, 0.6)
        viewer.drags("link_7", "update", 0.6, 0.3, 0.6)
        wait_until(lambda: simulator.state().status == "stopped")
        viewer.drags("link_7", "end", 0.6, 0.3, 0.6)
        assert simulator.state().tool_frame.z_mm > here[2] - 190.0, "long before its target"
        assert simulator.state().error.code == 0


def test_a_viewer_that_vanishes_while_it_pulls_lets_go(simulator: Simulator) -> None:
    with page_of(simulator) as port:
        with viewing(port) as viewer:
            shows(viewer, "stopped")
            viewer.drags("link_3", "start", 0.6, 0.3, 0.6)
            wait_until(lambda: any(simulator.state().joint_torque))
        wait_until(lambda: not any(simulator.state().joint_torque))


def test_a_command_is_typed_and_its_garbled_reply_found_in_the_dialogue(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer:
        shows(viewer, "stopped")
        types(viewer, "Command", "lin move : 1 2")
        shows(viewer, "lin move : 1 2", "3040 lin move takes", "#c92a2a")
        simulator.backdoor.set_fault(Garble(), replies=1)
        types(viewer, "Command", "get status")
        shows(viewer, "get status", "stopped", "~")


def test_what_other_benches_do_is_in_the_dialogue_and_what_the_page_does_once(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer:
        shows(viewer, "stopped")
        viewer.clicks("Emergency stop")
        shows(viewer, "page # emergency stop")
        BackdoorClient("127.0.0.1", simulator.backdoor_port or 0).set_input(number=3, on=True)
        simulator.backdoor.set_input(4, True)
        shows(
            viewer,
            "(backdoor) # set_input(number=3, on=True)",
            "backdoor # set_input(4, True)",
            "page # emergency stop",
        )
        lists = [
            html
            for message in viewer.seen
            if "set_input(number=3" in (html := str(message.get("updates", {}).get("content", "")))
        ]
        assert lists
        assert all(html.count("# emergency stop</div>") == 1 for html in lists)


def types(viewer: Viewer, label: str, text: str) -> None:
    """Writes a line into a form, and Enter."""
    uuid = viewer.labelled(label)
    viewer.clicks(label, text)
    form = viewer.until(lambda message: message.get("uuid") == uuid)["container_uuid"]
    viewer.send(type="GuiFormSubmitMessage", uuid=form)


def test_of_a_fleet_the_robot_that_is_chosen_is_stopped(simulator: Simulator) -> None:
    with Simulator("kr_6_r900_sixx", protocol=["krc4"], status_port=0, backdoor_port=0) as other:
        places = place_of(simulator, name="first"), place_of(other, name="second")
        with page_at(*places) as port, viewing(port) as viewer:
            viewer.until(lambda message: message.get("props", {}).get("text") == "second")
            shows(viewer, "LBR iiwa 7 R800")
            viewer.clicks("Robot", "second")
            shows(viewer, "KR 6")
            viewer.commands("Emergency stop")
            shows(viewer, "KR 6", "pressed")
            assert other.state().error.code == 3030
            assert simulator.state().error.code == 0


def test_without_a_backdoor_it_finds_the_robot_and_can_stop_it(simulator: Simulator) -> None:
    with (
        page_of(simulator, backdoor=False) as port,
        viewing(port) as viewer,
        Iiwa(simulator.host, simulator.port) as robot,
    ):
        robot.joint_move(*FAR)
        shows(viewer, "moving", "LBR iiwa 7 R800")
        viewer.clicks("Stop")
        shows(viewer, "stopped")
        assert robot.get_status() == "stopped"


def test_nobody_looking_costs_the_robot_nothing(simulator: Simulator) -> None:
    with page_of(simulator):
        assert simulator.call(lambda: len(simulator._status.connections)) == 0  # type: ignore[union-attr]


@pytest.mark.parametrize("backdoor", [True, False])
def test_nobody_there_is_told_in_one_line(backdoor: bool) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        nobody = free.getsockname()[:2]
    with pytest.raises(StationFault, match="Connection refused"):
        Station(Place(status=nobody, backdoor=nobody if backdoor else None)).describe()
