"""A cell.toml: its robot, surfaces, gripper and parts, and one line for each fault in it."""

from __future__ import annotations

import re
from math import inf, radians
from pathlib import Path

import pytest

from iiwa_sim.cell.cell import load_cells, robot_alone, shared_world, summary
from iiwa_sim.cell.settings import CellFault, NoiseSettings
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.controller.carrying import NO_TOOL
from iiwa_sim.controller.handling import NO_HANDLING
from iiwa_sim.controller.limits_watch import NOTHING_MORE
from iiwa_sim.frames import Frame, apply, inverse
from iiwa_sim.robot.description import RobotFault, load_robot
from iiwa_sim.world.gripper import Jaws
from tests.cell.cells import cell_from

TOOL = """
[tool_in_flange]
x_mm = 0
y_mm = 0
z_mm = 150
alpha = 0
beta = 0
gamma = 0
"""
TABLE = """
[[box]]
name = "table"
size_mm = [800, 1000, 40]
x_mm = 600
z_mm = 280
stiffness_n_per_m = 20000
"""

ALL_SURFACES = """
[[sphere]]
name = "ball"
radius_mm = 30
x_mm = 1
y_mm = 2
z_mm = 3
alpha = 0.1
beta = 0.2
gamma = 0.3
stiffness_n_per_m = 5000
damping_s_per_m = 0.5
friction = 0.3
[[plane]]
name = "floor"
stiffness_n_per_m = 1e5
[[cylinder]]
name = "rod"
radius_mm = 10
length_mm = 300
z_mm = -500
stiffness_n_per_m = 50000
"""


def test_an_empty_file_is_the_default_robot_alone(tmp_path: Path) -> None:
    cell = cell_from(tmp_path, "")
    assert cell.description == load_robot()
    assert cell.start == cell.description.home
    assert cell.tool_in_flange == cell.description.tool_in_flange
    assert cell.surfaces == ()
    assert (cell.surfaces, cell.noise) == ((), None)
    assert cell.input_names == robot_alone().input_names == tuple(f"input {n}" for n in range(1, 17))
    assert cell.output_names == robot_alone().output_names == tuple(f"output {n}" for n in range(1, 17))


def test_robot_start_and_tool(tmp_path: Path) -> None:
    start_deg = [10, 20, 30, -40, 50, 60, 70]
    robot = f'robot = "lbr_iiwa_14_r820"\nstart_deg = {start_deg}\ncontact_radius_mm = 4\n'
    cell = cell_from(tmp_path, robot + TOOL)
    assert cell.description == load_robot("lbr_iiwa_14_r820")
    assert cell.start == tuple(map(radians, start_deg))
    assert cell.tool_in_flange == Frame(0, 0, 150, 0, 0, 0).to_transform()
    assert cell.contact_radius_m == 0.004
    assert cell_from(tmp_path, 'start_deg = "home"').start == load_robot().home


def test_surfaces_in_metres(tmp_path: Path) -> None:
    floor, table, ball, rod = cell_from(tmp_path, ALL_SURFACES + TABLE).surfaces
    assert (floor.name, floor.shape, floor.stiffness) == ("floor", Plane(), 1e5)
    assert (floor.damping, floor.friction, floor.pose.translation) == (0.0, 0.0, (0.0, 0.0, 0.0))
    assert table.shape == pytest.approx(Box(0.4, 0.5, 0.02))
    assert isinstance(table.shape, Box)
    assert ball.shape == Sphere(0.03)
    assert ball.pose == Frame(1, 2, 3, 0.1, 0.2, 0.3).to_transform()
    assert (ball.stiffness, ball.damping, ball.friction) == (5000.0, 0.5, 0.3)
    assert rod.shape == Cylinder(0.01, 0.15)


def test_bodies_fixed_to_the_flange(tmp_path: Path) -> None:
    text = "[tool]\nmass_kg = 1.5\ncentre_mm = [10, 0, 60]\ninertia_kgm2 = [0.001, 0.001, 0.002, 0, 0, 0]\n"
    cell = cell_from(tmp_path, text)
    assert cell.tool == ((1.5, (0.01, 0.0, 0.06)), (0.001, 0.001, 0.002, 0.0, 0.0, 0.0), ())
    assert cell_from(tmp_path, "").tool == NO_TOOL
    touching = cell_from(tmp_path, text + "capsules_mm = [[0, 0, 0, 0, 10, 80, 20]]\n").tool
    assert touching is not None
    assert touching.capsules == (("tool", 0, (0.0, 0.0, 0.0), (0.0, 0.01, 0.08), 0.02, 1.0),)


def test_a_gripper_and_its_wiring(tmp_path: Path) -> None:
    cell = cell_from(tmp_path, GRIPPER + "open_output = 15\nholds_input = 3\n")
    jaws = (0.08, 0.1, 40.0, 0.02, 0.02, (0.02, 0.008, 0.05))
    assert cell.handled[:3] == (jaws, (16, 15, 0, 0, 3), ())
    thin = cell_from(tmp_path, GRIPPER + "jaw_mm = [10, 4, 30]\n").handled
    assert isinstance(thin.gripper, Jaws)
    assert thin.gripper.jaw_m == pytest.approx((0.01, 0.004, 0.03))
    assert cell_from(tmp_path, "").handled == NO_HANDLING


def test_parts_lie_on_surfaces_and_fall_elsewhere(tmp_path: Path) -> None:
    standing = (
        PART + "x_mm = 600\nz_mm = 320.05\n" + PART.replace("cube", "other") + "x_mm = -600\nz_mm = 200\n"
    )
    cell = cell_from(tmp_path, GRIPPER + standing + TABLE)
    (cube, _), (other, pose) = cell.handled.parts
    assert cube == ("cube", Box(0.02, 0.02, 0.02), 0.2, 0.5, 1e5)
    assert (other.name, pose.translation) == ("other", (-0.6, 0.0, 0.2))
    lines = summary([cell])
    assert "part 'cube' lies\n" in lines
    assert "part 'other' falls\n" in lines


def test_safety_limits(tmp_path: Path) -> None:
    text = (
        "[safety]\ncollision_force_n = 80\ntcp_speed_mm_per_s = 250\n"
        "box_min_mm = [200, -400, 250]\nbox_max_mm = [800, 400, 900]\n"
    )
    cell = cell_from(tmp_path, text)
    assert cell.safety == (80.0, inf, 0.25, ((0.2, -0.4, 0.25), (0.8, 0.4, 0.9)))
    assert cell_from(tmp_path, "").safety == NOTHING_MORE


def test_noise_and_io(tmp_path: Path) -> None:
    text = '[noise]\nseed = 7\nforce_n = 0.2\n[io]\ninputs = ["door", "part"]\noutputs = 0\n'
    cell = cell_from(tmp_path, text)
    assert cell.noise == NoiseSettings(7, 0.2)
    assert (cell.input_names, cell.output_names) == (("door", "part"), ())


GRIPPER = "[gripper]\nstroke_mm = 80\nspeed_mm_per_s = 100\ngrip_force_n = 40\nclose_output = 16\n"
PART = '[[part]]\nname = "cube"\nshape = "box"\nsize_mm = [40, 40, 40]\nmass_kg = 0.2\n'
SPHERE = '[[sphere]]\nname = "ball"\nradius_mm = 30\nstiffness_n_per_m = 5000\n'
FAULTS = [
    # what stands there, then key and value that the line names, or no key and what is expected
    ("robot = ", "", ""),
    ('strat_deg = "home"', "strat_deg", "'home'"),
    ("start_deg = [0, 30]", "start_deg", r"\[0\.0, 30\.0\]"),
    ("start_deg = [0, 121, 0, 0, 0, 0, 0]", r"start_deg\[1\]", "121.0"),
    (TOOL.replace("z_mm = 150", ""), "tool_in_flange.z_mm", r"\(missing\)"),
    (GRIPPER.replace("= 16", "= 17"), "gripper.close_output", "17"),
    (GRIPPER + "[io]\noutputs = 4", "gripper.close_output", "16"),
    (GRIPPER + PART.replace('"box"', '"cone"'), r"part\[0\].shape", "'cone'"),
    (GRIPPER + PART + PART, r"part\[1\].name", "'cube'"),
    (GRIPPER + PART + "x_mm = 600\nz_mm = 310\n" + TABLE, "", "part 'cube' .* surface 'table' .* 10 m"),
    (SPHERE.replace("ball", "table") + TABLE, r"sphere\[0\].name", "'table'"),
    (SPHERE.replace("5000", "'x'"), r"sphere\[0\].stiffness_n_per_m", "'x'"),
    (TABLE.replace("z_mm = 280", "z_mm = 400") + TOOL, "start_deg", "'home'"),
    ("[noise]\nseed = 1.5", "noise.seed", "1.5"),
    ("[safety]\nbox_min_mm = [0, 0, 0]\nbox_max_mm = [100, 900, 900]", "start_deg", "'home'"),
]


@pytest.mark.parametrize(("text", "key", "value"), FAULTS)
def test_a_fault_is_one_line_with_place_and_reason(tmp_path: Path, text: str, key: str, value: str) -> None:
    with pytest.raises(CellFault) as fault:
        cell_from(tmp_path, text).controller(0.002)
    place = f"{key} = {value}: expected " if key else f"expected {value}"
    pattern = f"{re.escape(str(tmp_path / 'cell.toml'))}: {place}."
    assert re.match(pattern, str(fault.value)), str(fault.value)
    assert str(fault.value).isprintable()
    assert len(str(fault.value)) < len(str(tmp_path)) + 600
    assert fault.value.__suppress_context__ or fault.value.__context__ is None


@pytest.mark.parametrize(
    ("text", "near"),
    [
        ("contact_radius = 5.0", ", did you mean 'contact_radius_mm'?"),
        ('[[plane]]\nname = "floor"\nstiffness_n_per_m = 1e5\nfricton = 0.3', ", did you mean 'friction'?"),
        ('[[part]]\nname = "it"\nshape = "box"\nmas_kg = 1', ", did you mean 'mass_kg'?"),
        ("[safety]\nqqq = 1", "; there are box_max_mm, box_min_mm, collision_force_n, collision_torque_nm, "),
    ],
)
def test_a_misspelt_key_names_the_similar_one(tmp_path: Path, text: str, near: str) -> None:
    with pytest.raises(CellFault) as fault:
        cell_from(tmp_path, text)
    assert f"expected no key of this name{near}" in str(fault.value)


def test_an_unknown_robot(tmp_path: Path) -> None:
    says = r"^robot .*/lbr_iiwa_7_r80: expected a folder, or one of kr_6.*, did you mean 'lbr_iiwa_7_r800'\?"
    with pytest.raises(RobotFault, match=says):
        cell_from(tmp_path, 'robot = "lbr_iiwa_7_r80"')


@pytest.mark.parametrize("path", ["", "no such.toml", "x" * 5000])
def test_an_unusable_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CellFault, match=r": expected (an existing|a regular|a readable text) file") as fault:
        load_cells(path)[0]
    assert str(fault.value).isprintable()
    assert len(str(fault.value)) < 300


def test_a_byte_order_mark_is_ignored(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_bytes(b"\xef\xbb\xbfcontact_radius_mm = 4\r\n")
    assert load_cells(tmp_path / "cell.toml")[0].contact_radius_m == 0.004


TWO = """
[[robot]]
name = "left"
tool = { mass_kg = 1.0 }
[[robot]]
name = "right"
model = "lbr_iiwa_14_r820"
x_mm = 1000
gamma = 0.5
protocol = ["iiwa", "krc4"]
port = [30000, 30005]
start_deg = [0, 20, 0, -90, 0, 45, 0]
[[plane]]
name = "floor"
z_mm = -100
stiffness_n_per_m = 1e5
"""


def test_each_robot_sees_the_cell_from_its_base(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(TWO + "friction = 0.2\n[noise]\nseed = 7\nforce_n = 1")
    left, right = load_cells(tmp_path / "cell.toml")
    assert (left.name, left.ports, left.tool == NO_TOOL) == ("left", {"iiwa": 0}, False)
    assert (right.name, right.ports, right.tool) == ("right", {"iiwa": 30000, "krc4": 30005}, NO_TOOL)
    assert right.description.name == "LBR iiwa 14 R820"
    for cell in (left, right):
        depth = [surface.nearest(*apply(inverse(cell.base), (0.3, 0.2, -0.05)))[0] for surface in cell.seen()]
        assert depth == pytest.approx([0.05])
    assert left.noise != right.noise, "or both would read the same noise"


THIRD = '[[robot]]\nname = "third"\n'


@pytest.mark.parametrize(
    ("added", "reason"),
    [
        ('[[robot]]\nname = "left"', "robot[2].name = 'left': expected another name than that of robot[0]"),
        ('[[robot]]\nname = "a/b"', "robot[2].name = 'a/b': expected up to 40 letters, digits, - and _"),
        ("[[robot]]\nmodel = 'kr_6_r900_sixx'", "robot[2].name = (missing): expected this key"),
        (f"{THIRD}port = 70000", "robot[2].port = 70000: expected an integer from 0 to 65535"),
        (f"{THIRD}port = [1, 2]", "robot[2].port = [1, 2]: expected one port"),
        (f'{THIRD}protocol = "smtp"', "robot[2].protocol = 'smtp': expected iiwa, krc4, or a list"),
        (f"{THIRD}y_mm = 1e9", "robot[2].y_mm = 1000000000.0: expected a number from -10000 to"),
        (f"{THIRD}speed = 1", "robot[2].speed = 1: expected no key of this name"),
        (f"{THIRD}[robot.safety]\nbox_min_mm = 5", "robot[2].safety.box_min_mm = 5: expected a list of 3"),
        (f"{THIRD}contact_radius_mm = -1", "robot[2].contact_radius_mm = -1: expected a number"),
        (f"{THIRD}z_mm = -1500", "robot[2].start_deg = 'home': expected a pose with the TCP outside"),
        ("[part]", "part = {}: expected an array: write [[part]]"),
        (f"{THIRD}[[robot.tool]]", "robot[2].tool = [{}]: expected one table: write [robot.tool]"),
        ("[tool]\nmass_kg = 1.0", "tool = {'mass_kg': 1.0}: expected none beside [[robot]]"),
    ],
)
def test_a_wrong_entry_of_several_robots_is_one_line(tmp_path: Path, added: str, reason: str) -> None:
    with pytest.raises(CellFault) as fault:
        cell_from(tmp_path, TWO + added)
    assert str(fault.value).startswith(f"{tmp_path / 'cell.toml'}: {reason}")
    assert str(fault.value).isprintable()


def test_robots_that_collide_at_the_start_are_named(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(TWO.replace("x_mm = 1000", "x_mm = 50"))
    reason = r"expected iiwa_\w+ of robot 'left' at most 1 mm inside iiwa_\w+ of robot 'right' at .*, not \d+"
    with pytest.raises(CellFault, match=reason):
        shared_world(load_cells(tmp_path / "cell.toml"), 0.002)


@pytest.mark.parametrize("text", ["robot = []", "contact_radius_mm = 3" + TWO])
def test_keys_that_do_not_go_with_several_robots(tmp_path: Path, text: str) -> None:
    with pytest.raises(CellFault, match=r"(1 to 28 robots|= 3: expected none beside)"):
        cell_from(tmp_path, text)
