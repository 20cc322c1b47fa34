"""Contents of recordings."""

from __future__ import annotations

import json
from base64 import b64decode
from collections import Counter
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest
from jsonschema import Draft202012Validator
from mcap.reader import make_reader

from iiwa_sim.cell.bodies import BoxSettings
from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.controller.state import snapshot
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose, rotation_from_quaternion
from iiwa_sim.recordings.recorder import VIEW_PERIOD_NS
from iiwa_sim.recordings.schemas import (
    ARM,
    CHANNELS,
    DIALOGUE,
    EVENTS,
    FRAMES,
    LOG,
    STATE,
)
from iiwa_sim.simulator import Simulator
from tests.recordings.recorded import FAR, RATE_HZ, Robot, contents, found_in

ROOT = Path(__file__).parents[2]
SPEEDS = (0.9,) * 7


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording in which everything happens."""
    path = tmp_path_factory.mktemp("recorded") / "session.mcap"
    cell = ROOT / "examples" / "table.toml"
    with Simulator(cell=cell, clock="fast", record=path) as simulator:
        backdoor = simulator.backdoor
        with Iiwa(simulator.host, simulator.port) as driver:
            driver.hello()
            driver.joint_move(FAR, SPEEDS)
            driver.wait_until_stopped(60)
            driver.joint_move([0, 0.5, 0, -1, 0, 1.5, 0], SPEEDS)
            driver.lin_move((600, 0, 350, 3.14159265359, 0, 3.14159265359), 0.5, 0)
            driver.wait_until_stopped(60)
            driver.linforcez_move((600, 0, 290, 3.14159265359, 0, 3.14159265359), 0.1, 0, 10)
            driver.wait_until_stopped(60)
            driver.lin_move((600, 0, 350, 3.14159265359, 0, 3.14159265359), 0.5, 0)
            driver.wait_until_stopped(60)
            with pytest.raises(CommandError):
                driver.lin_move((2000, 0, 0, 0, 0, 0), 0.5, 0)
            driver.smart_joint_move([0, 0.4, 0, -1, 0, 1.5, 0], SPEEDS)
            driver.wait_until_stopped(60)
            backdoor.push((0, 0, 5, 0, 0, 0))
            box = BoxSettings(name="box", stiffness_n_per_m=1e4, x_mm=-900, size_mm=(10, 20, 30))
            backdoor.add_surface(box)
            backdoor.set_clock("stepped")
            driver.joint_move(FAR, SPEEDS)
            simulator.advance(0.1)
            backdoor.emergency_stop()
            simulator.advance(0.3)
            backdoor.emergency_stop(False)
            driver.reset_error()
        simulator.advance(0.1)
    return path


def test_every_channel_has_messages_that_fit_the_schema_in_the_file(session: Path) -> None:
    counts: Counter[str] = Counter()
    validators: dict[str, Draft202012Validator] = {}
    for found in found_in(session):
        counts[found.topic] += 1
        if found.topic not in validators:
            validators[found.topic] = Draft202012Validator(json.loads(found.schema))
        if counts[found.topic] % 40 in (0, 1) or found.topic in ("/scene", "/cell"):
            validators[found.topic].validate(found.content)
    assert set(counts) == set(CHANNELS)
    assert counts[STATE] > counts[FRAMES] > 0
    assert counts[EVENTS] == counts[LOG]


def test_times_are_those_of_the_robot(session: Path) -> None:
    """With a fast clock real time would show the motion within milliseconds."""
    states = found_in(session, STATE)
    for first, state in pairwise(states):
        assert state.log_ns - first.log_ns == 1_000_000_000 // RATE_HZ
    views = [found.log_ns for found in found_in(session, FRAMES)]
    periods = {after - before for before, after in pairwise(views)}
    assert periods == {VIEW_PERIOD_NS}


def test_events_of_a_session_are_recorded(session: Path) -> None:
    events = contents(session, EVENTS)
    recorded = [(event["kind"], event["move"], event["code"], event["text"]) for event in events]
    assert ("mode", 0, 0, "unknown -> normal") in recorded
    assert ("mode", 0, 0, "normal -> smart") in recorded
    assert ("move accepted", 1, 0, "normal") in recorded
    assert ("move begins", 1, 0, "normal") in recorded
    assert ("move ends", 1, 0, "at its target") in recorded
    contact = next(event for event in events if event["kind"] == "contact")
    assert contact["move"] == 4
    assert "along z of the TCP" in contact["text"]
    assert ("move ends", 4, 0, contact["text"]) in recorded
    refused = next(event for event in events if event["kind"] == "refused")
    assert refused["code"] == 3021
    assert "'lin move : 2000" in refused["text"]
    assert ("fault", 0, 3030, "emergency stop") in recorded
    assert ("move ends", 7, 3030, "emergency stop") in recorded
    calls = [text for kind, *_, text in recorded if kind == "backdoor"]
    assert calls[0] == "push((0, 0, 5, 0, 0, 0))"
    assert calls[1].startswith("add_surface(BoxSettings(name='box'")
    assert calls[2:] == ["set_clock('stepped')", "emergency_stop()", "emergency_stop(False)"]


def test_frames_agree_with_the_recorded_state(session: Path) -> None:
    """The chain of frames from the base to the flange, multiplied, is the flange frame of that tick."""
    states = {found.log_ns: found.content for found in found_in(session, STATE)}
    for found in found_in(session, FRAMES)[::20]:
        state = states[found.log_ns]
        chain = {each["child_frame_id"]: each for each in found.content["transforms"]}

        def pose_of(frame: str, chain: dict = chain) -> Transform:
            if frame not in chain:
                return IDENTITY
            each = chain[frame]
            rotation = rotation_from_quaternion(tuple(each["rotation"][key] for key in "xyzw"))
            own = Transform(rotation, tuple(each["translation"][key] for key in "xyz"))
            return compose(pose_of(each["parent_frame_id"]), own)

        frames = {"flange_media_126": "flange_frame", "tcp": "tool_frame", "goal": "goal_frame"}
        for name, frame in frames.items():
            wanted = Frame(*state[frame]).to_transform()
            assert pose_of(name).translation == pytest.approx(wanted.translation, abs=1e-6)
            assert pose_of(name).rotation == pytest.approx(wanted.rotation, abs=1e-6)


def test_the_meshes_of_the_arm_are_recorded_once(session: Path) -> None:
    (arm,) = contents(session, ARM)
    links = {entity["id"]: entity["models"] for entity in arm["entities"] if entity["models"]}
    assert list(links) == [f"iiwa_link_{number}" for number in range(8)]
    (model,) = links["iiwa_link_3"]
    file = ROOT / "robots" / "lbr_iiwa_7_r800" / "meshes" / "iiwa_link_3.glb"
    assert (model["media_type"], b64decode(model["data"])) == ("model/gltf-binary", file.read_bytes())


def test_urdf_and_cell_are_attached_and_the_run_is_described(session: Path) -> None:
    with session.open("rb") as file:
        reader = make_reader(file)
        attached = {each.name: each.data for each in reader.iter_attachments()}
        found = {each.name: each.metadata for each in reader.iter_metadata()}
    assert attached["cell.toml"] == (ROOT / "examples" / "table.toml").read_bytes()
    assert attached["robot.urdf"] == (ROOT / "robots" / "lbr_iiwa_7_r800" / "robot.urdf").read_bytes()
    assert attached["robot.toml"] == (ROOT / "robots" / "lbr_iiwa_7_r800" / "robot.toml").read_bytes()
    head = found["iiwa_sim"]
    assert (head["robot"], head["clock"], head["rate_hz"]) == ("LBR iiwa 7 R800", "fast", "500")
    assert head["seed"] == "none"
    assert head["version"]
    assert found["iiwa_sim_end"] == {"lost_messages": "0"}


def test_a_state_is_a_line_of_the_status_port(tmp_path: Path) -> None:
    robot = Robot(tmp_path / "a.mcap")
    robot.goes_to(*FAR)
    robot.controller.load.wrench = (1 / 3, -2 / 3, 3.0, 0.1, 0.0, 0.0)
    robot.step(100)
    line = json.loads(msgspec.json.encode(snapshot(robot.controller)))
    assert line.pop("gripper") is None, "which is left out"
    robot.end()
    assert contents(tmp_path / "a.mcap", STATE)[-1] == line, "bit for bit"


@pytest.mark.parametrize(("rate_hz", "every"), [(100, 5)])
def test_the_record_rate_is_that_of_the_states(tmp_path: Path, rate_hz: int, every: int) -> None:
    path = tmp_path / "a.mcap"
    robot = Robot(path, rate_hz=rate_hz)
    robot.goes_to(*FAR)
    robot.step(1250)
    robot.end()
    ticks = [state["tick"] for state in contents(path, STATE)]
    assert ticks[0] == 0
    assert ticks[-1] == 1250, "the last one in any case"
    assert set(range(every, 1250, every)) <= set(ticks)
    assert len(ticks) <= 1250 // every + 2
    assert [event["kind"] for event in contents(path, EVENTS)][:3] == ["mode", "move accepted", "move begins"]


def test_recording_begins_and_ends_while_the_robot_moves(tmp_path: Path) -> None:
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    with Simulator(clock="stepped") as simulator, Iiwa(simulator.host, simulator.port) as driver:
        driver.joint_move(FAR, SPEEDS)
        simulator.advance(0.1)
        with simulator.record(first):
            simulator.advance(0.1)
            recording = simulator.record(second, 100)
            simulator.advance(0.1)
        driver.get_status()
        simulator.advance(0.1)
        recording.close()
        recording.close()
        simulator.advance(0.1)
        left = simulator.record(tmp_path / "third.mcap")
    assert [state["tick"] for state in contents(first, STATE)] == list(range(50, 151))
    ticks = [state["tick"] for state in contents(second, STATE)]
    assert ticks == list(range(100, 201, 5))
    found = contents(second, DIALOGUE)
    assert [each["text"] for each in found] == ["get status", "moving"]
    assert contents(tmp_path / "third.mcap", STATE)[-1]["status"] in ("moving", "stopped")
    left.close()
