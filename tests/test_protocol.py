"""The protocol table against the requirements' Appendix B, written down here a second time."""

import pytest

from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import quaternion_from_rotation
from iiwa_sim.protocols.table import Quantity, load_table
from iiwa_sim.robot.description import load_robot
from tests.protocols.fake_robot import Conversation

FRAME = "x y z alpha beta gamma"
JOINTS = "j0 j1 j2 j3 j4 j5 j6"
SPEEDS = "v0 v1 v2 v3 v4 v5 v6"
FORCE = "fx fy fz tx ty tz"
SHIFT = "dx dy dz dalpha dbeta dgamma"
QUATERNION = "qx qy qz qw"
THRESHOLDS = "thresholdX thresholdY thresholdZ"

# command: (parameters, words or values of the reply)
APPENDIX_B = {
    "hello": ("", "hello"),
    "bye": ("", "bye"),
    "smart joint move": (f"{JOINTS} {SPEEDS}", "done"),
    "direct joint move": (f"{JOINTS} {SPEEDS}", "done"),
    "smart cartesian move": (f"{FRAME} speed", "done"),
    "direct cartesian move": (f"{FRAME} speed", "done"),
    "joint move": (f"{JOINTS} {SPEEDS}", "done"),
    "lin move": (f"{FRAME} speed blending", "done"),
    "ptp move": (f"{FRAME} speed blending", "done"),
    "linr move": (f"{FRAME} speed blending r", "done"),
    "ptpr move": (f"{FRAME} speed blending r", "done"),
    "linforcez move": (f"{FRAME} speed blending thresholdZ", "done"),
    "ptpforcez move": (f"{FRAME} speed blending thresholdZ", "done"),
    "linforce move": (f"{FRAME} speed blending {THRESHOLDS}", "done"),
    "ptpforce move": (f"{FRAME} speed blending {THRESHOLDS}", "done"),
    "linstiff move": (f"{FRAME} speed stiffness {FORCE}", "done"),
    "ptpstiff move": (f"{FRAME} speed stiffness {FORCE}", "done"),
    "start gravity": (
        "joint_stiffness",
        "done",
    ),  # the text's `stiffness`, but of the joints and in another unit
    "get tool frame": ("", FRAME),
    "get flange frame": ("", FRAME),
    "get status": ("", "moving stopped"),
    "get cartesian force": ("", FORCE),
    "get joint position": ("", JOINTS),
    "get joint torque": ("", "t0 t1 t2 t3 t4 t5 t6"),
    "stop": ("", "done"),
}
TABLE = load_table("iiwa")


def test_the_table_holds_appendix_b_and_extensions_marked_as_such():
    ours = {name for name, command in TABLE.commands.items() if command.extension}
    assert set(TABLE.commands) - ours == set(APPENDIX_B)
    assert not ours & set(APPENDIX_B)


@pytest.mark.requirement("FRA005", "FRC001")
def test_parameters_and_replies_are_those_of_appendix_b():
    for name, (parameters, reply) in APPENDIX_B.items():
        command = TABLE.commands[name]
        assert [each.name for each in command.parameters] == parameters.split(), name
        assert [each.name for each in command.reply.values] or list(command.reply.words) == reply.split(), (
            name
        )
        assert not command.phrase, name


def fitting_line(name: str, robot: Controller, parameter: str, value: float) -> str:
    """Return a move to where the robot is, with one parameter at a given value."""
    servo = TABLE.commands[name].mode in ("smart", "direct")
    driven = robot.flange_frame() if servo else robot.tool_frame()
    frame = dict(zip(FRAME.split(), driven, strict=True))
    joints = dict(zip(JOINTS.split(), robot.joints, strict=True))
    orientation = quaternion_from_rotation(driven.to_transform().rotation)
    quaternion = dict(zip(QUATERNION.split(), orientation, strict=True))
    others = {"blending": 0.0, "r": robot.joints[2], "n": 1, **dict.fromkeys(SHIFT.split(), 0.0)}
    fitting = {**frame, **joints, **quaternion, **others, parameter: value}
    words = [repr(fitting.get(each.name, 0.5)) for each in TABLE.commands[name].parameters]
    return f"{name} : {' '.join(words)}"


def edges(quantity: Quantity) -> tuple[list[float], list[float]]:
    """Return values just inside and just outside of a range."""
    inside, outside = [], []
    if quantity.above is not None:
        inside += [quantity.above + 1e-3]
        outside += [quantity.above, quantity.above - 1e-3]
    if quantity.minimum is not None:
        inside += [quantity.minimum]
        outside += [quantity.minimum - 1e-3]
    if quantity.maximum is not None:
        inside += [quantity.maximum]
        outside += [quantity.maximum + 1e-3]
    return inside, outside


def test_the_controller_keeps_the_tables_ranges():
    tried = set()
    for name, command in TABLE.commands.items():
        for quantity in command.parameters:
            kind = quantity.name.rstrip("0123456789"), quantity.range, command.mode
            if not quantity.range or name == "set input" or kind in tried:
                continue
            tried.add(kind)
            inside, outside = edges(quantity)
            robot = Controller(load_robot("lbr_iiwa_7_r800"), 0.002)
            talk = Conversation(robot)
            for value in outside:
                line = fitting_line(name, robot, quantity.name, value)
                assert talk.ask(line) == "error", line
            assert not robot.moving
            for value in inside:
                line = fitting_line(name, robot, quantity.name, value)
                assert talk.ask(line) in command.reply.words, line
