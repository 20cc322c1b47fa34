"""Forward kinematics against figures of the arm and Pinocchio, and the contents of the URDF."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import Frame, Transform, transform_from_euler
from iiwa_sim.robot.model import Model
from tests.robot.arms import BUILT_IN, Arm, arm_named

SEVEN, FOURTEEN = "lbr_iiwa_7_r800", "lbr_iiwa_14_r820"
MEDIA, TOUCH = "flange_media_126", "flange_touch_152"
ZERO, TRANSPORT, HOME = (0,) * 7, (0, 25, 0, 90, 0, 0, 0), (0, 30, 0, -60, 0, 90, 0)
ROLLED = (10, 20, 30, 40, 50, 60, 70)
SIX, FLANGE = "kr_6_r900_sixx", "flange"


@pytest.mark.requirement("FRC005", "FRO001")
@pytest.mark.parametrize(
    ("robot", "flange", "joints_deg", "position_mm", "angles_deg"),
    [
        (SEVEN, MEDIA, ZERO, (0, 0, 1266), (0, 0, 0)),
        (SEVEN, TOUCH, ZERO, (0, 0, 1292), (0, 0, 0)),
        (FOURTEEN, MEDIA, ZERO, (0, 0, 1306), (0, 0, 0)),
        (SEVEN, MEDIA, TRANSPORT, (-307.671, 0, 924.820), (0, -65, 0)),
        (SEVEN, TOUCH, TRANSPORT, (-331.235, 0, 935.808), (0, -65, 0)),
        (FOURTEEN, MEDIA, TRANSPORT, (-299.218, 0, 962.946), (0, -65, 0)),
        (SEVEN, MEDIA, HOME, (600, 0, 560.410), (180, 0, 180)),
        (SEVEN, TOUCH, HOME, (600, 0, 534.410), (180, 0, 180)),
        (FOURTEEN, MEDIA, HOME, (610, 0, 597.731), (180, 0, 180)),
        (SEVEN, MEDIA, ROLLED, (43.852, -42.581, 1178.064), (157.514, 21.958, 32.924)),
        (SEVEN, TOUCH, ROLLED, (41.717, -26.402, 1198.305), (157.514, 21.958, 32.924)),
        (FOURTEEN, MEDIA, ROLLED, (50.589, -41.393, 1216.858), (157.514, 21.958, 32.924)),
        (SIX, FLANGE, (0,) * 6, (980, 0, 435), (0, 90, 0)),
        (SIX, FLANGE, (0, -90, 90, 0, 0, 0), (525, 0, 890), (0, 90, 0)),
        (SIX, FLANGE, (0, -90, 90, 0, 90, 0), (445, 0, 810), (180, 0, 180)),
        (SIX, FLANGE, (10, -80, 70, 20, 30, 40), (575.025, -115.284, 930.502), (-120.285, 27.642, -110.644)),
    ],
)
def test_the_flange_is_where_it_is_on_the_real_arm(
    robot: str,
    flange: str,
    joints_deg: tuple[float, ...],
    position_mm: tuple[float, ...],
    angles_deg: tuple[float, ...],
) -> None:
    model = arm_named(robot, flange).model
    frame = Frame.from_transform(model.flange([math.radians(value) for value in joints_deg]))
    assert frame[:3] == pytest.approx(position_mm, abs=1e-3)
    off = [math.remainder(a - math.radians(b), math.tau) for a, b in zip(frame[3:], angles_deg, strict=True)]
    assert np.degrees(off) == pytest.approx([0, 0, 0], abs=1e-3)


@pytest.mark.requirement("FRO001")
@pytest.mark.parametrize(("robot", "weight_kg"), [(SEVEN, 23.9), (FOURTEEN, 29.9)])
def test_the_urdf_has_the_mass_of_the_arm(robot: str, weight_kg: float) -> None:
    links = ET.fromstring(arm_named(robot).description.urdf).iter("mass")
    assert sum(float(mass.attrib["value"]) for mass in links) == pytest.approx(weight_kg, abs=1e-9)


@pytest.mark.requirement("FRO001")
def test_the_urdf_has_visual_and_collision_bodies(arm: Arm) -> None:
    robot = ET.fromstring(arm.description.urdf)
    moved = [joint.find("child") for joint in robot.findall("joint[@type='revolute']")]
    names = [child.attrib["link"] for child in moved if child is not None]
    assert len(names) == arm.model.joint_count
    for name in names:
        link = robot.find(f"link[@name='{name}']")
        assert link is not None
        assert link.find("visual/geometry") is not None
        assert link.find("collision/geometry") is not None
    assert not list(robot.iter("mesh"))


@pytest.mark.requirement("FRO001")
def test_urdf_inertias_are_those_of_real_bodies(arm: Arm) -> None:
    for inertia in ET.fromstring(arm.description.urdf).iter("inertia"):
        x, y, z = sorted(float(inertia.attrib[key]) for key in ("ixx", "iyy", "izz"))
        assert x > 0
        assert z <= x + y


@pytest.mark.requirement("FRO001")
def test_urdf_limits_are_those_of_the_controller(arm: Arm) -> None:
    d = arm.description
    joints = ET.fromstring(d.urdf).findall("joint[@type='revolute']")
    assert [joint.attrib["name"] for joint in joints] == list(d.joints)
    for index, joint in enumerate(joints):
        limit = joint.find("limit")
        assert limit is not None
        found = {key: float(value) for key, value in limit.attrib.items()}
        wanted = (d.position_min[index], d.position_max[index], d.torque[index], d.velocity[index])
        assert found == pytest.approx(
            dict(zip(("lower", "upper", "effort", "velocity"), wanted, strict=True)), abs=1e-8
        )


# The TCP, beside Pinocchio

TOOL = transform_from_euler(0.01, -0.02, 0.15, 0.3, -0.8, 1.9)
MODELS = {name: arm_named(name).model for name in BUILT_IN}
positions = st.lists(st.floats(-6.5, 6.5), min_size=7, max_size=7)


def by_pinocchio(model: Model, q: list[float]) -> tuple[Transform, np.ndarray]:
    reference = pin.buildModelFromXML(model.description.urdf)
    flange = reference.getFrameId(model.description.flange)
    tool = pin.SE3(np.array(TOOL.rotation).reshape(3, 3), np.array(TOOL.translation))
    on = reference.frames[flange]
    tcp = reference.addFrame(
        pin.Frame("TCP", on.parentJoint, flange, on.placement * tool, pin.FrameType.OP_FRAME)
    )
    data = reference.createData()
    jacobian = pin.computeFrameJacobian(
        reference, data, np.array(q), tcp, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    pose = data.oMf[tcp]
    return Transform(tuple(pose.rotation.ravel()), tuple(pose.translation)), jacobian


@pytest.mark.parametrize("name", BUILT_IN)
@given(q=positions)
def test_pinocchio_agrees(name: str, q: list[float]) -> None:
    model = MODELS[name]
    q = q[: model.joint_count]
    tcp = model.tcp(TOOL)
    pose, jacobian = by_pinocchio(model, q)
    assert tcp.pose(q).rotation == pytest.approx(pose.rotation, abs=2e-15)
    assert tcp.pose(q).translation == pytest.approx(pose.translation, abs=2e-15)
    assert np.abs(tcp.jacobian(q) - jacobian).max() <= 3e-15
    wrench = (1.0, -2.0, 3.0, 0.4, -0.5, 0.6)
    turn = np.array(pose.rotation).reshape(3, 3)
    torques = jacobian.T @ np.concatenate([turn @ wrench[:3], turn @ wrench[3:]])
    assert tcp.torques(q, wrench) == pytest.approx(torques.tolist(), abs=3e-14)
