"""Pictures of a scene's cameras: as PNG from Python and over HTTP, and on ROS."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path

import pytest
from websockets.sync.client import connect

from iiwa_sim import Refused, Simulator, camera
from iiwa_sim.backdoor.client import BackdoorClient

CELL = Path(__file__).parent.parent / "examples" / "conveyor.toml"
BELT = 2


@pytest.fixture(scope="module")
def shared() -> Iterator[Simulator]:
    """A simulator whose state is only read."""
    with Simulator(cell=CELL, clock="stepped", backdoor_port=0) as simulator:
        yield simulator


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator(cell=CELL, clock="stepped", backdoor_port=0, rosbridge_port=0) as simulator:
        yield simulator


@pytest.fixture
def rendering(simulator: Simulator) -> Simulator:
    """A simulator on a machine that can render."""
    try:
        simulator.camera("overview", 8, 8)
    except Refused as refused:
        pytest.skip(refused.reason)
    return simulator


def pixels(png: bytes) -> tuple[int, int, list[bytes]]:
    """Return width, height and the rows of a PNG of ours."""
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    chunks, at = {}, 8
    while at < len(png):
        (size,) = struct.unpack_from(">I", png, at)
        kind, content = png[at + 4 : at + 8], png[at + 8 : at + 8 + size]
        assert struct.unpack_from(">I", png, at + 8 + size)[0] == zlib.crc32(kind + content)
        chunks[kind] = content
        at += 12 + size
    assert [*chunks] == [b"IHDR", b"IDAT", b"IEND"]
    width, height, *rest = struct.unpack(">IIBBBBB", chunks[b"IHDR"])
    assert rest == [8, 2, 0, 0, 0]
    rows = zlib.decompress(chunks[b"IDAT"])
    wide = 3 * width + 1
    assert rows[::wide] == bytes(height), "no filter"
    return width, height, [rows[wide * y + 1 : wide * (y + 1)] for y in range(height)]


def asked(simulator: Simulator, path: str) -> tuple[int, str, bytes]:
    """Ask the backdoor; return status, type and body."""
    assert simulator.backdoor_port is not None
    connection = HTTPConnection(simulator.host, simulator.backdoor_port, timeout=60)
    connection.request("GET", path)
    answer = connection.getresponse()
    found = answer.status, answer.headers["Content-Type"], answer.read()
    connection.close()
    return found


def test_rows_of_pixels_become_a_png() -> None:
    rgb = bytes(range(36))
    assert pixels(camera.png(rgb, 4, 3)) == (4, 3, [rgb[:12], rgb[12:24], rgb[24:]])


def test_a_picture_shows_moved_bodies_and_changes_nothing(rendering: Simulator) -> None:
    with Simulator(cell=CELL, clock="stepped") as alone:
        backdoor = BackdoorClient(rendering.host, rendering.backdoor_port or 0)
        before = pixels(backdoor.camera("overview", 160, 120))
        for each in (rendering, alone):
            each.call(lambda each=each: each.controller.io.set_output(BELT, on=True))
            each.advance(0.5)
        status, kind, png = asked(rendering, "/camera/overview?width=160&height=120")
        assert (status, kind) == (200, "image/png")
        assert alone.state() == rendering.state()
    assert pixels(png) != before
    width, height, rows = before
    assert (width, height) == (160, 120)
    assert len(set(b"".join(rows))) > 50, "not all of one colour"


@pytest.mark.parametrize(
    ("path", "status", "reason"),
    [
        ("/camera/nowhere", 409, "no camera 'nowhere': the scene has overview"),
        ("/camera/overview?width=5000", 409, "a picture of 5000 x 480: expected 1 to 4096 pixels each"),
        ("/camera", 400, "camera(name, width=640, height=480): Object missing required field `name`"),
        ("/camera/overview?depth=1", 400, "camera(name, width=640, height=480): Object contains unknown"),
    ],
)
def test_an_unknown_camera(shared: Simulator, path: str, status: int, reason: str) -> None:
    found, _, body = asked(shared, path)
    assert found == status
    assert json.loads(body)["error"]["reason"].startswith(reason)


def test_a_machine_that_cannot_render(shared: Simulator, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(camera, "import_module", missing)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(
        Refused, match=r"no picture by egl \(ImportError: No module named 'mujoco.egl'\): it needs"
    ):
        shared.camera("overview")
    with (
        Simulator(clock="stepped") as bare,
        pytest.raises(Refused, match="the cell has no scene with cameras"),
    ):
        bare.camera("overview")


def test_ros_gets_compressed_images(rendering: Simulator) -> None:
    topic, kind = "/camera/overview/compressed", "sensor_msgs/CompressedImage"  # as ROS 1 names it
    with connect(f"ws://{rendering.host}:{rendering.rosbridge_port}", max_size=None) as client:
        client.send(json.dumps({"op": "subscribe", "topic": topic, "type": kind, "id": "1"}))
        client.send(json.dumps({"op": "call_service", "service": "/rosapi/topics"}))
        assert topic in json.loads(client.recv(60))["values"]["topics"]
        rendering.advance(0.1)
        found = json.loads(client.recv(60))["msg"]
    assert (found["header"]["frame_id"], found["format"]) == ("overview", "png")
    assert "secs" in found["header"]["stamp"]
    assert pixels(base64.b64decode(found["data"]))[:2] == (640, 480)
