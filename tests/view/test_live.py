"""The whole page beside a robot: what a viewer sees of it, and what it does to it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.simulator import Simulator
from iiwa_sim.view.live import run_page
from iiwa_sim.view.station import Place, Station, StationFault
from tests.talking import DEADLINE_S
from tests.view.viewer import Message, Viewer, viewing

FAR = ((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)


@contextmanager
def page_of(simulator: Simulator, backdoor: bool = True) -> Iterator[int]:
    """The port of a page that shows it."""
    assert simulator.status_port is not None
    assert simulator.backdoor_port is not None
    place = Place(
        status=("127.0.0.1", simulator.status_port),
        backdoor=("127.0.0.1", simulator.backdoor_port) if backdoor else None,
        driver=("127.0.0.1", simulator.port),
    )
    over, opened = threading.Event(), threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        page = threading.Thread(target=run_page, args=(listening, [place], over, None, opened.set))
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


def test_surfaces_and_contacts_are_drawn(simulator: Simulator) -> None:
    with page_of(simulator) as port, viewing(port) as viewer:
        shows(viewer, "stopped")
        x_mm, y_mm, z_mm = simulator.state().tool_frame[:3]
        box = f"{x_mm} {y_mm} {z_mm - 50.0001} 0 0 0 100 100 100 1e5 0 0"
        ask(simulator, f"add box : block {box}")
        viewer.until(lambda message: message["type"] == "BoxMessage" and "/cell/" in message["name"])
        viewer.until(
            lambda message: (
                message["type"] == "SetSceneNodeVisibilityMessage"
                and message["name"].endswith("/contact/0")
                and message["visible"]
            )
        )


def ask(simulator: Simulator, line: str) -> None:
    assert simulator.backdoor_port is not None
    with socket.create_connection(("127.0.0.1", simulator.backdoor_port), DEADLINE_S) as bench:
        bench.sendall(line.encode() + b"\n")
        assert bench.recv(100) == b"done\r\n"


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
        assert simulator.call(lambda: len(simulator._status.readers)) == 0  # type: ignore[union-attr]


@pytest.mark.parametrize("backdoor", [True, False])
def test_nobody_there_is_told_in_one_line(backdoor: bool) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        nobody = free.getsockname()[:2]
    with pytest.raises(StationFault, match="Connection refused"):
        Station(Place(status=nobody, backdoor=nobody if backdoor else None)).describe()
