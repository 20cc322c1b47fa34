"""A scene of MuJoCo in a cell: faults in one line, and wires to inputs and outputs."""

from __future__ import annotations

from pathlib import Path

import pytest

from iiwa_sim import Simulator
from iiwa_sim.cell.bodies import BoxSettings
from iiwa_sim.cell.cell import load_cells, summary
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.controller.state import snapshot
from iiwa_sim.frames import Frame
from tests.requests import ptp_move
from tests.stepped import SteppedRobot
from tests.world.scenes import table

TICK_S = 0.002
SCENE = """<mujoco>
<default><geom rgba="1 0 0 1" contype="4" conaffinity="4"/><joint damping=".5"/></default>
<asset><mesh name="knob" vertex="0 0 0 .05 0 0 0 .05 0 0 0 .05"/></asset>
<worldbody>
  <geom name="floor" type="plane" size="2 2 .1"/>
  <body name="belt" pos=".55 -.4 .38">
    <geom name="belt" type="box" size=".1 .3 .02" friction=".6" surfacevel="0 5 0 0 0 0"/>
  </body>
  <site name="eye" pos=".65 -.2 .415" zaxis="-1 0 0"/>
  <camera name="over" pos="1.5 -1.5 1.2" xyaxes=".7 .7 0 -.4 .4 .8"/>
  <body name="roller" pos="1.2 0 .5">
    <joint name="roller" axis="0 1 0" damping=".01"/>
    <geom type="cylinder" size=".03 .1" euler="90 0 0" mass=".5"/>
  </body>
  <body name="door" pos=".3 .5 .5">
    <joint name="hinge" axis="0 0 1" range="0 90" limited="true"/>
    <geom name="panel" type="box" size=".2 .01 .2" pos=".2 0 0" mass="2"/>
    <geom name="knob" type="mesh" mesh="knob" pos=".3 .02 0" mass=".1"/>
  </body>
  <body name="pad" pos=".75 .3 .31">
    <geom name="pad" type="box" size=".04 .04 .01"/><site name="pad" type="box" size=".05 .05 .03"/>
  </body>
</worldbody>
<equality><joint name="lock" joint1="hinge" polycoef="0 0 0 0 0" active="true"/></equality>
<actuator><velocity name="roller" joint="roller" kv="1"/><motor name="push" joint="hinge"/></actuator>
<sensor>
  <rangefinder name="light_barrier" site="eye" cutoff="1"/><touch name="pad" site="pad"/>
  <jointpos name="door" joint="hinge"/>
</sensor>
<keyframe><key name="home" qpos="1 1"/></keyframe>
</mujoco>"""
WIRES = """scene = {file = "scene.xml"}
input = [{number = 3, sensor = "light_barrier", below = 0.19}, {number = 4, sensor = "pad", above = 1.0},
         {number = 5, sensor = "door", above = 0.5}]
output = [{number = 1, actuator = "belt", on = 0.2}, {number = 2, actuator = "roller", on = 5},
          {number = 3, actuator = "lock", on = 0, off = 1}, {number = 3, actuator = "push", on = 2}]
"""
PARTS = "".join(
    f"""[[part]]
name = "{name}"
shape = "box"
size_mm = [40, 40, 30]
mass_kg = 0.2
x_mm = {x}
y_mm = {y}
z_mm = {z}
"""
    for name, x, y, z in (("ride", 550, -600, 415), ("weight", 750, 300, 336))
)
BELT, ROLLER, DOOR = 1, 2, 3


def robot_in(folder: Path, text: str = WIRES + PARTS, scene: str = SCENE) -> SteppedRobot:
    """Return a robot in a cell with a scene."""
    (folder / "scene.xml").write_text(scene)
    (folder / "cell.toml").write_text(text)
    return SteppedRobot(cell=load_cells(folder / "cell.toml")[0], tick_s=TICK_S)


BROKEN = {
    "not closed": ("</body>", "", "XML_ERROR_MISMATCHED_ELEMENT ErrorID=14 (0xe) Line number=6"),
    "unknown element": ("<site ", "<sight ", "unrecognized element Element 'sight', line 9"),
    "a name taken twice": ('body name="door"', 'body name="belt"', "repeated name 'belt' in body Element"),
    "no mesh file": ('vertex="0 0 0 .05 0 0 0 .05 0 0 0 .05"', 'file="none.stl"', "file 'none.stl'"),
    "an actuator of nothing": ('roller" kv', 'rotor" kv', "'rotor' for actuator id = 0 Element name"),
    "a body without mass": ('mass=".5"', 'mass="0"', "Element name 'roller', id 2, line 11"),
    "a lock of nothing": ('joint1="hinge"', 'joint1="hing"', "'hing' in equality constraint Element name"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), BROKEN.values(), ids=list(BROKEN))
def test_a_broken_scene_is_reported_in_one_line(tmp_path: Path, old: str, new: str, expected: str) -> None:
    text = SCENE.replace(old, new, 1)
    assert text != SCENE
    with pytest.raises(CellFault) as fault:
        robot_in(tmp_path, scene=text)
    line = str(fault.value)
    assert line.startswith(f"{tmp_path / 'scene.xml'}: expected a scene that MuJoCo takes: ")
    assert expected in line
    assert line.isprintable()


WRONG = {
    "unknown sensor": ('"light_barrier"', '"light_bar"', "input[0].sensor", "did you mean 'light_barrier'?"),
    "unknown actuator": ('"belt", on', '"x", on', "output[0].actuator", "an equality, or a geom"),
    "no such input": ("number = 3, s", "number = 17, s", "input[0].number", "one of the inputs 1 to 16"),
    "an input twice": ("number = 4, s", "number = 3, s", "input[1].number", "than that of input[0]"),
    "an input without a bound": (", below = 0.19", "", "input[0].above", "this key, or below"),
    "no scene": ('scene = {file = "scene.xml"}', "", "input[0].sensor", "of the [scene]: it has none"),
    "no file": ("scene.xml", "scenes.xml", "scene.file", "the path of an MJCF file in"),
    "a name of ours": ('name = "ride"', 'name = "door"', "scene.file", "surface or part has that name"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "key", "expected"), WRONG.values(), ids=list(WRONG))
def test_a_wrong_wire_gives_one_line(tmp_path: Path, old: str, new: str, key: str, expected: str) -> None:
    with pytest.raises(CellFault) as fault:
        robot_in(tmp_path, (WIRES + PARTS).replace(old, new, 1))
    assert str(fault.value).startswith(f"{tmp_path / 'cell.toml'}: {key} = ")
    assert expected in str(fault.value)


def test_outputs_drive_a_scene_and_inputs_follow_its_sensors(tmp_path: Path) -> None:
    robot = robot_in(tmp_path)
    controller, changes = robot.controller, {}
    assert "scene: scene, belt, roller, door, pad\n" in summary(load_cells(tmp_path / "cell.toml"))
    for tick in range(1600):
        for output, at in ((BELT, 100), (ROLLER, 100), (DOOR, 1000), (BELT, 1200)):
            if tick == at:
                controller.io.set_output(output, on=at < 1200)
        before = controller.io.inputs
        robot.step()
        if tick >= 100:
            assert controller.under_way == (tick >= 1200), "with `fast`, a belt runs in real time"
        for number, (was, on) in enumerate(zip(before, controller.io.inputs, strict=True), start=1):
            if was != on:
                changes[number, on] = tick, snapshot(controller)
    assert changes.keys() == {(3, True), (3, False), (4, True), (5, True)}
    dark, light = changes[3, True], changes[3, False]
    front_mm = dark[1].parts[0].frame.y_mm + 20.0
    assert 0.0 <= front_mm + 200.0 <= 0.4, "0.2 m/s: the front has passed in this tick"
    assert light[0] - dark[0] == 100, "40 mm"
    assert changes[5, True][1].bodies[3].frame.alpha == pytest.approx(0.5, abs=0.01)
    state = snapshot(controller)
    assert [each.name for each in state.bodies] == ["scene", "belt", "roller", "door", "pad"]
    assert state.bodies[3].frame == pytest.approx((300, 500, 500, 1.5708, 0, 0), abs=0.01), "to its stop"
    robot.step(50)
    later = snapshot(controller)
    assert later.parts[0].frame == pytest.approx(state.parts[0].frame, abs=1e-6), "the belt stands"
    assert later.parts[0].frame.y_mm == pytest.approx(-160.0, abs=1.0)
    assert later.bodies[2] != state.bodies[2], "the roller still turns"


def test_a_restored_scene_continues_with_the_same_bits(tmp_path: Path) -> None:
    robots = [robot_in(tmp_path) for _ in range(2)]
    runs = []
    for robot in robots:
        robot.step(100)
        robot.controller.io.outputs = (True,) * 16
        robot.step(400)
        runs.append(snapshot(robot.controller))
    assert runs[0] == runs[1]
    handling = robots[0].controller.handling
    assert handling is not None
    kept, inputs = handling.kept(), robots[0].controller.io.inputs
    for robot in robots:
        robot.step(200)
    expected = snapshot(robots[1].controller)
    kept()
    robots[0].controller.io.inputs = inputs
    robots[0].step(200)
    again = snapshot(robots[0].controller)
    assert (again.parts, again.bodies, again.inputs) == (expected.parts, expected.bodies, expected.inputs)


FURNITURE = """<mujoco>
<compiler angle="radian" autolimits="true" fusestatic="true"/>
<include file="classes.xml"/>
<worldbody>
  <body name="cabinet" pos=".6 .3 .3" childclass="wood">
    <geom size=".15 .15 .01"/><geom size=".15 .15 .01" class="seen"/>
    <body name="drawer" pos="0 0 .06">
      <joint type="slide" axis="0 1 0" range="0 .25"/>
      <geom size=".14 .14 .04" mass="1"/><geom name="handle" size=".01 .01 .06" pos="0 -.13 .1" mass=".1"/>
    </body>
  </body>
  <body name="tray" pos=".4 -.4 .1"><geom class="wood" size=".1 .1 .01"/></body>
  <body name="ball" pos=".4 -.4 .15"><freejoint/><geom size=".03"/></body>
  <body name="can" pos=".35 -.45 .16"><freejoint/><geom type="cylinder" size=".02 .04"/></body>
  <body name="screw" pos="0 .6 .5" gravcomp="1">
    <joint name="screw" type="slide" axis="0 0 1" damping="1"/><geom size=".02" mass=".1"/>
  </body>
</worldbody>
<actuator><velocity name="screw" joint="screw" kv="1000"/></actuator>
</mujoco>"""
CLASSES = """<mujocoinclude><default><default class="wood">
<geom type="box" contype="0" conaffinity="1" solref=".01 1"/><joint damping="5" frictionloss="1"/>
<default class="seen"><geom contype="0" conaffinity="0" group="2"/></default>
</default></default></mujocoinclude>"""
LATER = """scene = {file = "scene.xml"}
output = [{number = 1, actuator = "screw", on = 0.0005}]
contact_radius_mm = 10
tool_in_flange = {x_mm = 0, y_mm = 0, z_mm = 150, alpha = 0, beta = 0, gamma = 0}
"""


def test_the_arm_pushes_a_drawer_and_objects_come_to_rest(tmp_path: Path) -> None:
    (tmp_path / "classes.xml").write_text(CLASSES)
    robot = robot_in(tmp_path, LATER, FURNITURE)
    controller, touched = robot.controller, set[str]()
    for x_mm, y_mm, z_mm in ((600, 0, 500), (600, 0, 440), (600, 270, 440)):
        controller.move(ptp_move(Frame(x_mm, y_mm, z_mm, 3.14159265, 0.0, 3.14159265), 0.2))
        while controller.moving:
            robot.step()
            touched |= {each.surface for each in controller.load.link_contacts}
    state = snapshot(controller)
    places = {each.name: each.frame for each in state.bodies}
    assert state.error.code == 0
    assert 419.0 < places["drawer"].y_mm < 430.0, "its handle was 120 mm before the end of the move"
    assert touched == {"drawer"}
    assert [places[name].z_mm for name in ("ball", "can")] == pytest.approx([140.0, 150.0], abs=0.5)
    while not controller.resting:
        robot.step()
    controller.io.set_output(1, on=True)
    robot.step(1000)
    rise_mm = snapshot(controller).bodies[-1].frame.z_mm - places["screw"].z_mm
    assert rise_mm == pytest.approx(1.0, abs=0.05), "0.5 mm/s are slow, but no rest"


def test_a_heavy_ball_of_a_scene_lies_on_a_surface(tmp_path: Path) -> None:
    ball = '<freejoint/><geom type="sphere" size=".03" mass="20"/>'
    scene = f'<mujoco><worldbody><body pos=".5 .5 .331">{ball}</body></worldbody></mujoco>'
    robot = robot_in(tmp_path, 'scene = {file = "scene.xml"}\n' + table(), scene)
    robot.step(1000)
    assert robot.controller.resting
    assert snapshot(robot.controller).bodies[-1].frame.z_mm == pytest.approx(326.0, abs=4.0)


def test_each_robot_has_its_own_wires_and_a_belt_runs_on_after_a_new_surface(tmp_path: Path) -> None:
    wires = WIRES.splitlines()
    left, right = "\n".join(wires[1:3]), "\n".join(wires[3:])
    (tmp_path / "scene.xml").write_text(SCENE)
    robots = f'[[robot]]\nname = "left"\n{left}\n[[robot]]\nname = "right"\nx_mm = 2000\n{right}\n'
    (tmp_path / "cell.toml").write_text(f"{wires[0]}\n{robots}{PARTS}")
    with Simulator(cell=tmp_path / "cell.toml", clock="stepped") as simulator:
        one, two = simulator.robots["left"], simulator.robots["right"]
        simulator.call(lambda: two.controller.io.set_output(BELT, on=True))
        simulator.advance(0.5)
        one.backdoor.add_surface(BoxSettings(name="far", size_mm=(9, 9, 9), z_mm=2e3, stiffness_n_per_m=1e5))
        simulator.advance(1.45)
        assert one.state().inputs[2], "in the light barrier after 1.9 s at 0.2 m/s"
        assert not any(two.state().inputs)
        ours, theirs = one.state().bodies[1].frame, two.state().bodies[1].frame
        assert ours.x_mm - theirs.x_mm == pytest.approx(2000.0), "each in its base"
