"""Builds the MuJoCo model of a cell: surfaces, the arm and its gripper, parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco as mj
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.contact.payload import GRAVITY_M_S2
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import (
    IDENTITY,
    Rotation,
    Transform,
    apply,
    compose,
    inverse,
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Link, arm_model
from iiwa_sim.world.details import ALL, ARM, HELD, LOST, PARTS, SURFACES, soften
from iiwa_sim.world.gripper import Cup, Jaws
from iiwa_sim.world.material import Law
from iiwa_sim.world.part import Mesh, Part

HEAVY = 1e3
"""Armature (kg, kg m2) of what is imposed: hardly anything changes its velocity."""
FREE, GRASPED, LIGHT = 1, 2, 3
"""Priorities: which part's law and friction a contact has. A light free part would swing on the spring of a
held one."""
LIGHTEST = 2.0
"""A part is light if its stiffness times the square of a tick is more than so many times its mass."""
RIGID_N_PER_M = 1e8
"""Stiffness of links, jaws and tools, as parts feel it."""
MARGIN_M = 1e-4
"""Distance at which contacts of a body are found: it slides lifted by less than twice that."""
ROLLING, SPINNING = 0.002, 0.05
"""Rolling and torsional friction of balls and cylinders, over their radius: they come to rest, also a disc
that wobbles."""
TIP, CUP, JAWS = "tip", "cup", ("jaw 1", "jaw 2")
"""Names of what the gripper touches with, beside its tool."""


class ArmShape(NamedTuple):
    """An arm, and what is fixed to its flange."""

    description: RobotDescription
    tool_in_flange: Transform
    tool: tuple[Capsule, ...]  # in the flange
    radius_m: float  # of the contact sphere round the TCP


class Built(NamedTuple):
    """A compiled model, and the numbers of its geoms and bodies."""

    model: Any
    touching: dict[int, str]  # geoms of the arm, with the name of the link, jaw or tool
    tip: int  # geom of the contact sphere; -1 for none
    pads: tuple[int, ...]  # geoms of the pads, which collide with nothing, or of the cup
    fingers: tuple[int, ...]  # geoms of the jaws, or of the cup
    parts: NDArray[np.intp]  # geom of each part
    surfaces: NDArray[np.intp]  # body of each surface
    offsets: tuple[Transform | None, ...]  # frame of each part in its body; None where they are the same
    points: NDArray[np.intc]  # for each geom the least number of points in which it rests
    masses: NDArray[np.float64]  # for each part the inertia of its six dofs
    stands: NDArray[np.int8]  # for each geom 1 if it is that of a surface


def build(
    arm: ArmShape,
    kind: Jaws | Cup | None,
    surfaces: Sequence[Surface],
    parts: Sequence[tuple[Part, Transform]],
    law: Law,
    tick_s: float,
) -> Built:
    """Build the model. First in it are the hinges of the arm, then the gripper, jaws, and parts."""
    spec = mj.MjSpec()
    option = spec.option
    option.timestep, option.gravity = tick_s, [0.0, 0.0, -GRAVITY_M_S2]
    option.cone, option.impratio, option.tolerance = mj.mjtCone.mjCONE_ELLIPTIC, 100.0, 1e-12
    option.integrator = mj.mjtIntegrator.mjINT_EULER
    option.enableflags |= int(mj.mjtEnableBit.mjENBL_SLEEP)
    common = {"solref": law.solref, "solimp": law.solimp, "margin": MARGIN_M}
    rigid = {**common, "contype": ARM, "conaffinity": PARTS, "mass": 0.0}
    _add_arm(spec, arm.description, rigid)
    _add_gripper(spec, arm, kind, rigid)
    for number, surface in enumerate(surfaces):
        name, laid = f"surface {number}", {"contype": SURFACES, "conaffinity": PARTS + HELD + LOST}
        body = _add_body(spec.worldbody, name, surface.pose)
        geom = _add_shape(body, surface.shape, name, friction=[surface.friction, 0.0, 0.0], **common, **laid)
        if any(surface.surface_velocity):
            geom.surfacevel = [*surface.surface_velocity, 0.0, 0.0, 0.0]
    for number, (part, pose) in enumerate(parts):
        name, shape = f"part {number}", part.shape
        body = _add_body(spec.worldbody, name, pose)
        body.add_freejoint(name=name, align=isinstance(shape, Mesh))
        radius = shape.radius if isinstance(shape, Cylinder | Sphere) else 0.0
        loose: dict[str, Any] = {"contype": PARTS, "conaffinity": ALL, "mass": part.mass_kg}
        loose |= {
            "priority": priority(part, tick_s),
            "friction": [part.friction, SPINNING * radius, ROLLING * radius],
        }
        loose["condim"] = 6 if radius else 3
        if isinstance(shape, Mesh):
            spec.add_mesh(name=name, uservert=np.ravel(shape.corners).tolist())
            body.add_geom(type=mj.mjtGeom.mjGEOM_MESH, name=name, meshname=name, **common, **loose)
        else:
            _add_shape(body, shape, name, **common, **loose)
    model = spec.compile()
    for number, surface in enumerate(surfaces):
        soften(model, model.body(f"surface {number}").id, surface.stiffness, law)
    for number, (part, _) in enumerate(parts):
        soften(model, model.body(f"part {number}").id, part.stiffness, law)
    arms = [geom for geom in range(model.ngeom) if model.geom_contype[geom] == ARM]
    for geom in arms:
        soften(model, model.geom_bodyid[geom], RIGID_N_PER_M, law)
    kinds = mj.mjtGeom
    of_kind = {kinds.mjGEOM_SPHERE: 1, kinds.mjGEOM_CAPSULE: 1, kinds.mjGEOM_CYLINDER: 2}
    points = [of_kind.get(mj.mjtGeom(each), 4) for each in model.geom_type]
    names = (CUP,) if isinstance(kind, Cup) else JAWS if isinstance(kind, Jaws) else ()
    pads = names if isinstance(kind, Cup) else [f"pad {number}" for number in range(1, len(names) + 1)]
    return Built(
        model,
        {geom: model.geom(geom).name.partition("/")[0] for geom in arms},
        model.geom(TIP).id if arm.radius_m > 0.0 else -1,
        tuple(model.geom(name).id for name in pads),
        tuple(model.geom(name).id for name in names),
        np.array([model.geom(f"part {number}").id for number in range(len(parts))], np.intp),
        np.array([model.body(f"surface {number}").id for number in range(len(surfaces))], np.intp),
        tuple(
            _offset(model, f"part {number}", pose) if isinstance(part.shape, Mesh) else None
            for number, (part, pose) in enumerate(parts)
        ),
        np.array(points, np.intc),
        model.dof_M0[model.nv - 6 * len(parts) :].reshape(-1, 6).copy(),
        (model.geom_contype == SURFACES).astype(np.int8),
    )


def priority(part: Part, tick_s: float) -> int:
    """Return the priority of a part that moves freely."""
    return LIGHT if part.stiffness * tick_s * tick_s > LIGHTEST * part.mass_kg else FREE


def wxyz(rotation: Rotation) -> list[float]:
    """Return the quaternion of a rotation in MuJoCo's order."""
    x, y, z, w = quaternion_from_rotation(rotation)
    return [w, x, y, z]


def pose_of(position: Sequence[float]) -> Transform:
    """Return the pose of a place and a quaternion w x y z."""
    x, y, z, w, a, b, c = position
    return Transform(rotation_from_quaternion((a, b, c, w)), (x, y, z))


def _offset(model: Any, name: str, pose: Transform) -> Transform:
    """Return the part's frame in its body, which MuJoCo has put along the principal axes of inertia."""
    body = model.body(name)
    return compose(inverse(pose_of([*body.pos.tolist(), *body.quat.tolist()])), pose)


def _add_body(parent: Any, name: str, pose: Transform) -> Any:
    return parent.add_body(name=name, pos=list(pose.translation), quat=wxyz(pose.rotation))


def _add_shape(body: Any, shape: Shape, name: str, **more: Any) -> Any:
    kinds = mj.mjtGeom
    match shape:
        case Plane():
            return body.add_geom(type=kinds.mjGEOM_PLANE, name=name, size=[5.0, 5.0, 0.1], **more)
        case Box():
            return body.add_geom(type=kinds.mjGEOM_BOX, name=name, size=list(shape), **more)
        case Cylinder():
            return body.add_geom(
                type=kinds.mjGEOM_CYLINDER, name=name, size=[shape.radius, shape.half_z, 0.0], **more
            )
        case Sphere():
            return body.add_geom(type=kinds.mjGEOM_SPHERE, name=name, size=[shape.radius, 0.0, 0.0], **more)


def _add_capsule(body: Any, capsule: Capsule, back: Transform, name: str, **more: Any) -> None:
    """Add a capsule whose ends are told in a frame; `back` brings that to the body."""
    size = [capsule.radius_m, 0.0, 0.0]
    start, end = apply(back, capsule.start), apply(back, capsule.end)
    if capsule.start == capsule.end:
        body.add_geom(type=mj.mjtGeom.mjGEOM_SPHERE, name=name, size=size, pos=list(start), **more)
    else:
        body.add_geom(type=mj.mjtGeom.mjGEOM_CAPSULE, name=name, size=size, fromto=[*start, *end], **more)


def _make_light(body: Any) -> None:
    """Give a body that is imposed hardly any mass of its own, and no weight."""
    body.mass, body.inertia, body.ipos, body.explicitinertial = 1e-3, [1e-6] * 3, [0.0, 0.0, 0.0], True
    body.gravcomp = 1.0


def _add_arm(spec: Any, description: RobotDescription, rigid: dict[str, Any]) -> None:
    """Add the moving links of an arm as capsules on a chain of hinges."""
    all_links = arm_model(description).links
    chain: list[Link] = []
    link: Link | None = next(each for each in all_links if each.name == description.flange)
    while link is not None and link.parent is not None:
        chain.insert(0, link)
        link = all_links[link.parent]
    body, pose = spec.worldbody.add_body(name="base"), IDENTITY
    links: list[tuple[Any, Transform]] = [(body, inverse(pose))]
    for each in chain:
        body = body.add_body(pos=list(each.pose.translation), quat=wxyz(each.pose.rotation))
        pose = compose(pose, each.pose)
        if each.joint is not None:
            body.add_joint(
                name=f"hinge {each.joint}",
                type=mj.mjtJoint.mjJNT_HINGE,
                axis=list(each.axis),
                armature=HEAVY,
            )
            _make_light(body)
            links.append((body, inverse(pose)))
    for number, capsule in enumerate(capsules_of(description)):
        if capsule.joints > 0:
            moved, back = links[capsule.joints]
            _add_capsule(moved, capsule, back, f"{capsule.link}/{number}", **rigid)


def _add_gripper(spec: Any, arm: ArmShape, kind: Jaws | Cup | None, rigid: dict[str, Any]) -> None:
    """Add the gripper as a free body at the TCP, with jaws, or a cup, the contact sphere and the tool.

    It is no link of the chain: MuJoCo leaves out of contacts what turning links add to accelerations (the
    derivative of the Jacobian), so a part that is carried fast round the base would drift at the end of a
    chain, by some 4 mm/s. The constraint forces on its six dofs are the wrench at the TCP.
    """
    body = spec.worldbody.add_body(name="gripper")
    _make_light(body)
    body.add_joint(name="gripper", type=mj.mjtJoint.mjJNT_FREE, armature=HEAVY)
    if arm.radius_m > 0.0:
        _add_shape(body, Sphere(arm.radius_m), TIP, **rigid)
    for number, capsule in enumerate(arm.tool):
        _add_capsule(body, capsule, inverse(arm.tool_in_flange), f"{capsule.link}/{number}", **rigid)
    if isinstance(kind, Cup):
        half = 0.5 * kind.length_m
        _add_shape(body, Cylinder(kind.radius_m, half), CUP, pos=[0.0, 0.0, -half], **rigid)
    if not isinstance(kind, Jaws):
        return
    for name, side in zip(JAWS, (1.0, -1.0), strict=True):
        wide, thick, long = kind.jaw_m
        jaw = body.add_body(name=name)
        _make_light(jaw)
        jaw.add_joint(name=name, type=mj.mjtJoint.mjJNT_SLIDE, axis=[0.0, side, 0.0], armature=HEAVY)
        middle = [0.0, 0.5 * side * thick, -0.5 * long]
        _add_shape(jaw, Box(0.5 * wide, 0.5 * thick, 0.5 * long), name, pos=middle, **rigid)
        # The pad, against which it is measured whether a part is between the jaws.
        pad = Box(0.5 * kind.pad_wide_m, 0.25 * thick, 0.5 * kind.pad_long_m)
        middle = [0.0, 0.25 * side * thick, -0.5 * kind.pad_long_m]
        _add_shape(jaw, pad, f"pad {name[-1]}", pos=middle, contype=0, conaffinity=0, mass=0.0)
