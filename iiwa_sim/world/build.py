"""Builds the MuJoCo model of a cell: a scene, arms and their grippers, surfaces, parts."""

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
    compose,
    inverse,
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.capsules import Capsule, capsules_of
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import arm_model
from iiwa_sim.world.details import ALL, ARMS, PARTS, PASSING, SURFACES, arm_bit, soften
from iiwa_sim.world.gripper import Cup, Gripper, Jaws
from iiwa_sim.world.material import RIGID_N_PER_M, Law, law_of_arms
from iiwa_sim.world.part import Mesh, Part
from iiwa_sim.world.tick_kernel import IMPRATIO, OF_ARM, OF_PART, OF_SCENE, STANDS

HEAVY = 1e3
"""Armature (kg, kg m2) of imposed bodies: forces hardly change their velocity."""
LOWEST, SURFACE, FREE, GRASPED, LIGHT = -1, 1, 2, 3, 4
"""Priorities of contact laws and friction; bodies of a scene have 0, arms the least.
A light free part would swing on the spring of a held one; others have that spring, without damping."""
MARGIN_M = 1e-4
"""Distance at which contacts of a body are found: it slides lifted by less than twice that."""
ROLLING, SPINNING = 0.002, 0.05
"""Rolling and torsional friction of balls and cylinders, over their radius; a wobbling disc comes to rest."""


class ArmSetup(NamedTuple):
    """An arm at the start, and the bodies fixed to its flange."""

    description: RobotDescription
    joints: Joints  # rad, at rest
    tool_in_flange: Transform
    tool: tuple[Capsule, ...]  # in the flange
    radius_m: float  # of the contact sphere round the TCP, of an arm without gripper
    gripper: Gripper | None
    base: Transform  # in the world
    name: str


class BuiltArm(NamedTuple):
    """Elements of an arm by their numbers."""

    hinge: int  # joint of the first link; those of the others follow, then gripper and jaws
    gripper: int  # body
    touching: dict[int, str]  # geoms, with the name of the link, jaw or tool
    pads: list[int]  # geoms of the pads, which collide with nothing, or of the cup
    fingers: list[int]  # geoms of the jaws, or of the cup


class WorldModel(NamedTuple):
    """A compiled model, and the numbers of its geoms and bodies; those of the scene come first."""

    model: Any
    arms: list[BuiltArm]
    parts: NDArray[np.intp]  # geom of each part
    surfaces: NDArray[np.intp]  # body of each surface
    offsets: list[Transform]  # frame of each part in its body, which MuJoCo puts along the axes of inertia
    points: NDArray[np.intc]  # for each geom the least number of points in which it rests
    masses: NDArray[np.float64]  # for each part the inertia of its six dofs
    kinds: NDArray[np.int8]  # for each geom `OF_PART`, `STANDS`, `OF_ARM` or `OF_SCENE`


def build(
    arms: Sequence[ArmSetup],
    surfaces: Sequence[Surface],
    parts: Sequence[tuple[Part, Transform]],
    law: Law,
    tick_s: float,
    scene: Any = None,
) -> WorldModel:
    """Build the model.

    Arms, surfaces and parts are added to a copy of the `MjSpec` of a scene. They have no names, so all names
    are those of the scene. A contact of a part has the part's law and friction, also with the scene; one of
    an arm with the scene has the scene's.
    """
    spec = mj.MjSpec() if scene is None else scene.copy()
    option, foreign = spec.option, len(spec.geoms)
    option.timestep, option.gravity = tick_s, [0.0, 0.0, -GRAVITY_M_S2]
    option.cone, option.impratio, option.tolerance = mj.mjtCone.mjCONE_ELLIPTIC, IMPRATIO, 1e-12
    option.integrator = mj.mjtIntegrator.mjINT_IMPLICIT
    if not any(each.type == mj.mjtSensor.mjSENS_TOUCH for each in spec.sensors):
        option.enableflags |= int(mj.mjtEnableBit.mjENBL_SLEEP)  # bodies that sleep have no contacts
    common = {"solref": law.solref, "solimp": law.solimp, "margin": MARGIN_M}
    of_arms = [_add_arm(spec, arm, number, law) for number, arm in enumerate(arms)]
    of_surfaces = []
    for each in surfaces:
        laid = common | {"contype": SURFACES, "conaffinity": PARTS + PASSING, "priority": SURFACE}
        laid |= {"friction": [each.friction, 0.0, 0.0], "surfacevel": [*each.surface_velocity, 0.0, 0.0, 0.0]}
        of_surfaces.append(_add_shape(_add_body(spec.worldbody, each.pose), each.shape, **laid))
    of_parts = [_add_part(spec, number, *each, common) for number, each in enumerate(parts)]
    model = spec.compile()
    geoms = np.array([geom.id for geom in of_parts], np.intp)
    bodies = model.geom_bodyid[geoms]
    laid_bodies = model.geom_bodyid[[geom.id for geom in of_surfaces]]
    soft = dict.fromkeys(model.geom_bodyid[foreign:].tolist(), RIGID_N_PER_M)
    soft |= zip(bodies.tolist(), (part.stiffness for part, _ in parts), strict=True)
    soft |= zip(laid_bodies.tolist(), (each.stiffness for each in surfaces), strict=True)
    for body, stiffness in soft.items():
        soften(model, body, stiffness, law)
    of_kind = {mj.mjtGeom.mjGEOM_SPHERE: 1, mj.mjtGeom.mjGEOM_CAPSULE: 1, mj.mjtGeom.mjGEOM_CYLINDER: 2}
    points = [of_kind.get(mj.mjtGeom(each), 4) for each in model.geom_type]
    kinds = np.full(model.ngeom, OF_SCENE, np.int8)
    kinds[foreign:] = OF_ARM
    kinds[geoms] = OF_PART
    kinds[model.body_weldid[model.geom_bodyid] == 0] = STANDS
    built = []
    for hinge, gripper, touching, *of_gripper in of_arms:
        names = {geom.id: name for geom, name in touching.items()}
        pads, fingers = ([geom.id for geom in of_each] for of_each in of_gripper)
        built.append(BuiltArm(hinge.id, gripper.id, names, pads, fingers))
    at = np.hstack([model.body_pos, model.body_quat])[bodies].tolist()
    offsets = [compose(inverse(pose_of(each)), pose) for each, (_, pose) in zip(at, parts, strict=True)]
    masses = model.dof_M0[model.nv - 6 * len(parts) :].reshape(-1, 6).copy()
    return WorldModel(model, built, geoms, laid_bodies, offsets, np.array(points, np.intc), masses, kinds)


def priority(part: Part, tick_s: float) -> int:
    """Return the priority of a part that moves freely."""
    return LIGHT if part.stiffness * tick_s * tick_s > 2.0 * part.mass_kg else FREE


def wxyz(rotation: Rotation) -> list[float]:
    """Return the quaternion of a rotation in MuJoCo's order."""
    x, y, z, w = quaternion_from_rotation(rotation)
    return [w, x, y, z]


def pose_of(position: Sequence[float]) -> Transform:
    """Return the pose of a place and a quaternion w x y z."""
    x, y, z, w, a, b, c = position
    return Transform(rotation_from_quaternion((a, b, c, w)), (x, y, z))


def _add_body(parent: Any, pose: Transform) -> Any:
    return parent.add_body(pos=list(pose.translation), quat=wxyz(pose.rotation))


def _add_shape(body: Any, shape: Shape, **more: Any) -> Any:
    kind = getattr(mj.mjtGeom, f"mjGEOM_{type(shape).__name__.upper()}")
    size = [5.0, 5.0, 0.1] if isinstance(shape, Plane) else [*shape, 0.0, 0.0][:3]
    return body.add_geom(type=kind, size=size, **more)


def _add_part(spec: Any, number: int, part: Part, pose: Transform, common: dict[str, Any]) -> Any:
    """Add a part; returns its geom."""
    shape, is_mesh = part.shape, isinstance(part.shape, Mesh)
    body = _add_body(spec.worldbody, pose)
    body.add_freejoint(align=is_mesh)
    radius = shape.radius if isinstance(shape, Cylinder | Sphere) else 0.0
    loose = common | {"contype": PARTS, "conaffinity": ALL, "mass": part.mass_kg}
    rubs, first = [part.friction, SPINNING * radius, ROLLING * radius], priority(part, spec.option.timestep)
    loose |= {"friction": rubs, "condim": 6 if radius else 3, "priority": first}
    if not isinstance(shape, Mesh):
        return _add_shape(body, shape, **loose)
    name = f"mesh of part {number}"
    spec.add_mesh(name=name, uservert=np.ravel(shape.corners).tolist())
    return body.add_geom(type=mj.mjtGeom.mjGEOM_MESH, meshname=name, **loose)


def _make_light(body: Any) -> None:
    """Give a body that is imposed hardly any mass of its own, and no weight."""
    body.mass, body.inertia, body.ipos, body.explicitinertial = 1e-3, [1e-6] * 3, [0.0, 0.0, 0.0], True
    body.gravcomp = 1.0


def _add_arm(spec: Any, arm: ArmSetup, number: int, law: Law) -> tuple[Any, ...]:
    """Add an arm: the moving links as capsules on a chain of hinges, then its gripper."""
    bit, on, hinges, links = arm_bit(number), law_of_arms(law), [], []
    rigid = {"solref": on.solref, "solimp": on.solimp, "margin": MARGIN_M, "condim": 1, "priority": LOWEST}
    rigid |= {"contype": bit, "conaffinity": PARTS + ARMS - bit, "mass": 0.0}
    body, pose = _add_body(spec.worldbody, arm.base), IDENTITY
    for each in arm_model(arm.description).fixed_poses[:-1]:
        body, pose = _add_body(body, each), compose(pose, each)
        hinges.append(body.add_joint(type=mj.mjtJoint.mjJNT_HINGE, armature=HEAVY))
        _make_light(body)
        links.append((body, inverse(pose)))
    gripper, touching, pads, fingers = _add_gripper(spec, arm, rigid)
    for capsule in capsules_of(arm.description):
        if capsule.joints > 0:
            touching[_add_capsule(*links[capsule.joints - 1], capsule, rigid)] = capsule.link
    return hinges[0], gripper, touching, pads, fingers


def _add_capsule(body: Any, back: Transform, capsule: Capsule, rigid: dict[str, Any]) -> Any:
    """Add a capsule whose pose is in another frame; `back` is that frame in the body."""
    at, size = compose(back, capsule.pose), [capsule.radius_m, max(0.5 * capsule.length_m, 1e-6), 0.0]
    place = {"pos": list(at.translation), "quat": wxyz(at.rotation)}
    return body.add_geom(type=mj.mjtGeom.mjGEOM_CAPSULE, size=size, **place, **rigid)


def _add_gripper(spec: Any, arm: ArmSetup, rigid: dict[str, Any]) -> tuple[Any, ...]:
    """Add the gripper as a free body at the TCP, with jaws, a cup or the contact sphere, and the tool.

    It is no link of the chain: MuJoCo leaves the derivative of the Jacobian out of contacts. A part that is
    carried fast round the base would drift at the end of a chain, by some 4 mm/s. The constraint forces on
    its six dofs are the wrench at the TCP.
    """
    kind, body = arm.gripper and arm.gripper.kind, spec.worldbody.add_body()
    _make_light(body)
    body.add_joint(type=mj.mjtJoint.mjJNT_FREE, armature=HEAVY)
    back, pads, fingers = inverse(arm.tool_in_flange), [], []
    touching = {_add_capsule(body, back, capsule, rigid): capsule.link for capsule in arm.tool}
    if kind is None and arm.radius_m > 0.0:
        touching[_add_shape(body, Sphere(arm.radius_m), **rigid)] = "tip"
    if isinstance(kind, Cup):
        half = 0.5 * kind.length_m
        pads = fingers = [_add_shape(body, Cylinder(kind.radius_m, half), pos=[0.0, 0.0, -half], **rigid)]
        touching[fingers[0]] = "cup"
    if isinstance(kind, Jaws):
        wide, thick, long = kind.jaw_m
        for name, side in (("jaw 1", 1.0), ("jaw 2", -1.0)):
            jaw = body.add_body()
            _make_light(jaw)
            jaw.add_joint(type=mj.mjtJoint.mjJNT_SLIDE, axis=[0.0, side, 0.0], armature=HEAVY)
            middle = [0.0, 0.5 * side * thick, -0.5 * long]
            fingers.append(_add_shape(jaw, Box(0.5 * wide, 0.5 * thick, 0.5 * long), pos=middle, **rigid))
            touching[fingers[-1]] = name
            # The pad, against which it is measured whether a part is between the jaws.
            pad = Box(0.5 * kind.pad_wide_m, 0.25 * thick, 0.5 * kind.pad_long_m)
            middle = [0.0, 0.25 * side * thick, -0.5 * kind.pad_long_m]
            pads.append(_add_shape(jaw, pad, pos=middle, contype=0, conaffinity=0, mass=0.0))
    return body, touching, pads, fingers
