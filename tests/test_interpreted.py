"""Kernels of contact and compliance: compiled and interpreted they make the same motion, bit for bit."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact import world_kernel
from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import transform_from_euler
from iiwa_sim.motion import compliance_kernel, joint_bounds_kernel, joint_springs_kernel
from iiwa_sim.robot import kinematics_kernel
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.inverse import inverse_of
from iiwa_sim.robot.model import Model
from tests.interpreted import interpreted
from tests.samples import some

TICK_S = 0.005
PLAIN_WORLD = interpreted("iiwa_sim.contact.world_kernel")
PLAIN_TCP = interpreted("iiwa_sim.robot.tcp_kernel")
PLAIN_KINEMATICS = interpreted("iiwa_sim.robot.kinematics_kernel")
PLAIN_BOUNDS = interpreted("iiwa_sim.motion.joint_bounds_kernel")
PLAIN_COMPLIANCE = interpreted("iiwa_sim.motion.compliance_kernel")
PLAIN_SPRINGS = interpreted("iiwa_sim.motion.joint_springs_kernel")
MODELS = [Model(load_robot(name)) for name in ("lbr_iiwa_7_r800", "kr_6_r900_sixx")]
SHAPES: list[Shape] = [Plane(), Box(0.05, 0.06, 0.02), Sphere(0.05), Cylinder(0.04, 0.03)]
few = settings(max_examples=some(25), deadline=None)
part = st.floats(-1.0, 1.0)
parts = st.lists(part, min_size=6, max_size=6)


@few
@given(shape=st.sampled_from(SHAPES), placed=parts, way=st.lists(parts, min_size=2, max_size=12))
def test_a_way_through_a_surface(shape: Shape, placed: list[float], way: list[list[float]]) -> None:
    pose = transform_from_euler(0.02 * placed[0], 0.02 * placed[1], 0.02 * placed[2], *placed[3:])
    surface = Surface("it", shape, pose, 2e4, 0.5, 0.4)
    compiled, plain = (module.World([surface], 0.005) for module in (world_kernel, PLAIN_WORLD))
    for x, y, z, *velocity in way:
        here = (0.06 * x, 0.06 * y, 0.06 * z)
        assert compiled.feel(here, tuple(velocity), TICK_S) == plain.feel(here, tuple(velocity), TICK_S)


class Parts:
    """What a motion in contact is made of."""

    def __init__(self, model: Model, kinematics: ModuleType, bounds: ModuleType, world: ModuleType) -> None:
        d = model.description
        self.kinematics = kinematics.Kinematics(model, inverse_of(model), d.tool_in_flange)
        if kinematics is PLAIN_KINEMATICS:
            self.kinematics.arm = PLAIN_TCP.Tcp(model.fixed_poses, d.tool_in_flange)
        self.bounds = bounds.JointBounds(
            TICK_S, d.position_min, d.position_max, d.velocity, d.stop_acceleration, d.stop_jerk
        )
        _, _, z = self.kinematics.tcp(d.home).translation
        top = transform_from_euler(0.0, 0.0, z - 0.004, 0.0, 0.0, 0.0)
        table = Surface("table", Plane(), top, 2e4, 0.5, 0.3)
        self.world = world.World([table], 0.005)
        self.load = ExternalLoad(model, d.tool_in_flange, d.home)

    def given(self) -> tuple[Any, ...]:
        return self.kinematics, self.bounds, TICK_S, self.load, self.world


def both(model: Model) -> tuple[Parts, Parts]:
    return (
        Parts(model, kinematics_kernel, joint_bounds_kernel, world_kernel),
        Parts(model, PLAIN_KINEMATICS, PLAIN_BOUNDS, PLAIN_WORLD),
    )


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.description.name)
@few
@given(wrenches=st.lists(parts, min_size=1, max_size=4), step=part, joint_push=part)
def test_yielding_around_a_motion(
    model: Model, wrenches: list[list[float]], step: float, joint_push: float
) -> None:
    home = model.description.home
    compiled, plain = both(model)
    yielding = compliance_kernel.Compliance(*compiled.given())
    plainly = PLAIN_COMPLIANCE.Compliance(*plain.given())
    yielding.start(home)
    plainly.start(home)
    for tick in range(40):
        x, y, z, a, b, c = wrenches[tick * len(wrenches) // 40]
        control = (100.0 * x, 100.0 * y, 200.0 * z, 10.0 * a, 10.0 * b, 10.0 * c)
        impedance = compliance_kernel.CartesianImpedance(2000.0, control)
        for each in (compiled, plain):
            each.load.joint_push = (joint_push * (tick > 20), *[0.0] * (model.joint_count - 1))
        nominal = tuple(q + 1e-3 * step * tick for q in home)
        assert yielding.step(nominal, impedance) == plainly.step(nominal, impedance)
        assert yielding.velocity == plainly.velocity
        here, there = yielding.tcp_contact, plainly.tcp_contact
        assert (here is None) == (there is None)
        assert here is None or (here.pose, here.touch) == (there.pose, there.touch)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.description.name)
@few
@given(wrenches=st.lists(parts, min_size=1, max_size=4), stiffness=st.floats(0.0, 1000.0))
def test_a_hold(model: Model, wrenches: list[list[float]], stiffness: float) -> None:
    home = model.description.home
    compiled, plain = both(model)
    holding = joint_springs_kernel.JointSprings(*compiled.given())
    plainly = PLAIN_SPRINGS.JointSprings(*plain.given())
    for each in (holding, plainly):
        each.start(home, [0.0] * model.joint_count, stiffness)
    for tick in range(40):
        x, y, z, a, b, c = wrenches[tick * len(wrenches) // 40]
        for each in (compiled, plain):
            each.load.wrench = (100.0 * x, 100.0 * y, 200.0 * z, 10.0 * a, 10.0 * b, 10.0 * c)
        assert holding.step() == plainly.step()
