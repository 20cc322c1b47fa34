"""A gripper and parts in a recording."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.recordings.schemas import CELL as CELLS
from iiwa_sim.recordings.schemas import FRAMES, SCENE, STATE
from tests.cell.cells import EXAMPLES, GRIPPER
from tests.recordings.recorded import contents, found_in

CELL = f"""{GRIPPER}
[[part]]
name = "pin"
shape = "cylinder"
radius_mm = 10
length_mm = 60
mass_kg = 0.1
x_mm = 500
z_mm = 60
""".replace("[gripper]", "[gripper]\njaw_mm = [20, 8, 70]")


def test_jaws_and_parts_are_frames_and_bodies(tmp_path: Path) -> None:
    path, cell = tmp_path / "run.mcap", tmp_path / "cell.toml"
    cell.write_text(CELL)
    with (
        Simulator(cell=cell, clock="stepped", record=path) as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        robot.set_output(1, True)
        simulator.advance(0.4)
        simulator.backdoor.remove_part("pin")
    states = found_in(path, STATE)
    for found in (states[0], states[-1]):
        Draft7Validator(json.loads(found.schema)).validate(found.content)
    openings_mm = [found.content["gripper"]["opening_mm"] for found in states]
    assert openings_mm[0] == 80.0
    assert openings_mm[-1] == pytest.approx(40.0)
    frames = contents(path, FRAMES)
    places = [
        {each["child_frame_id"]: each["translation"]["y"] for each in message["transforms"]}
        for message in (frames[0], frames[-1])
    ]
    assert [places[0][f"jaw_{number}"] for number in (1, 2)] == [0.04, -0.04]
    assert places[1]["jaw_1"] == pytest.approx(0.02, abs=0.01)
    bodies = {each["id"]: each["frame_id"] for each in contents(path, SCENE)[-1]["entities"]}
    assert bodies["jaw_1"] == "jaw_1"
    (jaw,) = next(each for each in contents(path, SCENE)[-1]["entities"] if each["id"] == "jaw_2")["cubes"]
    assert jaw["size"] == pytest.approx({"x": 0.02, "y": 0.008, "z": 0.07})
    assert jaw["pose"]["position"] == pytest.approx({"x": 0.0, "y": -0.004, "z": -0.035})
    assert bodies["part block"] == "part block"
    assert "part pin" not in bodies, "which is gone"
    first = contents(path, SCENE)[0]
    assert {"part block", "part pin"} <= {each["id"] for each in first["entities"]}
    (block,) = (each for each in frames[0]["transforms"] if each["child_frame_id"] == "part block")
    assert block["translation"] == pytest.approx({"x": 0.6, "y": 0.0, "z": 0.06}, abs=1e-4)
    cells = found_in(path, CELLS)
    Draft7Validator(json.loads(cells[0].schema)).validate(cells[0].content)
    assert [part["name"] for part in cells[-1].content["parts"]] == ["block"]
    assert cells[0].content["jaw_mm"] == pytest.approx([20.0, 8.0, 70.0])


def test_bodies_of_a_scene_are_frames_and_bodies(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with (
        Simulator(cell=EXAMPLES / "door.toml", clock="stepped", record=path, record_rate_hz=25) as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        robot.set_output(1, True)
        simulator.advance(4.0)
    places = [
        next(each["translation"] for each in message["transforms"] if each["child_frame_id"] == "body door")
        for message in contents(path, FRAMES)
    ]
    assert places[0] == pytest.approx({"x": 0.735, "y": 0.0, "z": 0.49}, abs=1e-3)
    assert places[-1] == pytest.approx({"x": 0.735, "y": 0.415, "z": 0.49}, abs=1e-2)
    entities = {each["id"]: each for each in contents(path, SCENE)[0]["entities"]}
    (panel,) = entities["body door"]["cubes"]
    assert panel["size"] == pytest.approx({"x": 0.016, "y": 0.42, "z": 0.44})
    assert panel["color"] == pytest.approx({"r": 0.9, "g": 0.5, "b": 0.2, "a": 0.8})
    for found in (found_in(path, CELLS)[0], found_in(path, STATE)[-1]):
        Draft7Validator(json.loads(found.schema)).validate(found.content)
    names = [body["name"] for body in found_in(path, CELLS)[0].content["bodies"]]
    assert names == ["scene", "machine", "door"]
