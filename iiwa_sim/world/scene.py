"""Scenes: a user's MJCF, and wires between its sensors and actuators and inputs and outputs."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import mujoco as mj
import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import IDENTITY, Transform, Vector, compose
from iiwa_sim.world.build import pose_of
from iiwa_sim.world.details import ALL, PARTS
from iiwa_sim.world.part import Mesh

OF_SCENE = 16
"""Collision bits of a scene are so many places higher: the lower ones are those of parts, surfaces, arms."""
SHOWN_GROUPS = range(3)
"""Groups of geoms that are shown; MuJoCo's own viewer shows the same."""
MOST_TRIANGLES = 5000
"""A mesh of more is shown as its bounding box; an ellipsoid is, too."""
PLANE_M = 2.0
"""Half an edge of a plane without end."""


class SceneShape(NamedTuple):
    """A geom of a scene as it is shown."""

    shape: Box | Cylinder | Sphere | Mesh
    pose: Transform  # in its body
    colour: tuple[float, float, float, float]


class SceneBody(NamedTuple):
    """A body of a scene that has geoms to show."""

    name: str
    number: int  # in the model
    shapes: tuple[SceneShape, ...]

    def pose_in(self, data: Any) -> Transform:
        """Return its pose in the world."""
        return pose_of([*data.xpos[self.number].tolist(), *data.xquat[self.number].tolist()])


class Scene:
    """A scene that MuJoCo accepts. Numbers of its elements are also those in the model of its cell."""

    def __init__(self, file: Path) -> None:
        """Raises ValueError and OSError, whose message names the element."""
        listener = mj.get_mju_user_warning()
        mj.set_mju_user_warning(lambda _: None)  # it would write into a file in the working directory
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # options of the scene do not count
                self.spec, self.model = _attached(mj.MjSpec.from_file(str(file.resolve())))
        finally:
            mj.set_mju_user_warning(listener)
        model = self.model
        self.sensors = _names(model, "sensor", model.nsensor)
        self.cameras = _names(model, "camera", model.ncam)
        self.body_names = _names(model, "body", model.nbody)
        self.bodies = _bodies(model)
        """The bodies that are shown, with what is fixed to the world first."""
        self._actuators = _names(model, "actuator", model.nu)
        geoms = _names(model, "geom", model.ngeom)
        velocities = ((name, model.geom_surfacevel[model.geom(name).id]) for name in geoms)
        self._conveyors = {name: _direction(along) for name, along in velocities if along.any()}
        self.drivable = (*self._actuators, *self._conveyors, *_names(model, "equality", model.neq))
        """Names that outputs may drive; an actuator comes before others of its name."""

    def sensor(self, name: str) -> tuple[slice, bool]:
        """Return where a sensor's readings are in `MjData.sensordata`, and whether it is a rangefinder."""
        found = self.model.sensor(name)
        first, size = int(found.adr[0]), int(found.dim[0])
        return slice(first, first + size), int(found.type[0]) == mj.mjtSensor.mjSENS_RANGEFINDER

    def driven(self, name: str) -> tuple[int, bool, tuple[float, ...]]:
        """Return the number of something `drivable`, True for an equality, and a conveyor's direction."""
        if name in self._actuators:
            return self.model.actuator(name).id, False, ()
        if name in self._conveyors:
            return self.model.geom(name).id, False, self._conveyors[name]
        return self.model.equality(name).id, True, ()


def _direction(velocity: Any) -> tuple[float, ...]:
    """Return `surfacevel` at a speed of 1 m/s, or 1 rad/s where it only turns."""
    speed = float(np.linalg.norm(velocity[:3])) or float(np.linalg.norm(velocity[3:]))
    return tuple((velocity / speed).tolist())


def _attached(scene: Any) -> tuple[Any, Any]:
    """Return a scene as part of another one, whose own bodies its defaults do not concern, and the model.

    Keyframes are left out, since they have the size of the scene alone.
    """
    for key in list(scene.keys):
        scene.delete(key)
    scene.compiler.fusestatic = scene.compiler.discardvisual = False  # both would take elements away
    for geom in scene.geoms:
        if geom.contype or geom.conaffinity:  # the cell's own bodies meet all that collides
            geom.contype = (geom.contype << OF_SCENE & ALL) + PARTS
            geom.conaffinity = geom.conaffinity << OF_SCENE & ALL
    scene.compile()  # what attaches it drops elements that refer to nothing
    spec = mj.MjSpec()
    spec.attach(scene, prefix="", frame=spec.worldbody.add_frame())
    return spec, spec.compile()


def _names(model: Any, kind: str, count: int) -> tuple[str, ...]:
    """Return the names of elements that have one."""
    named = getattr(model, kind)
    return tuple(name for name in (named(number).name for number in range(count)) if name)


def _bodies(model: Any) -> tuple[SceneBody, ...]:
    """Return the bodies to show; those without a name have that of the parent and a number."""
    names: list[str] = ["scene"]
    found = []
    for number in range(model.nbody):
        if number:
            parent = names[model.body_parentid[number]]
            names.append(model.body(number).name or f"{parent} {number}")
        first, count = int(model.body_geomadr[number]), int(model.body_geomnum[number])
        shown = [geom for geom in range(first, first + count) if model.geom_group[geom] in SHOWN_GROUPS]
        shapes = tuple(each for geom in shown for each in _shapes(model, geom))
        if shapes:
            found.append(SceneBody(names[number], number, shapes))
    return tuple(found)


def _shapes(model: Any, geom: int) -> list[SceneShape]:
    """Return a geom as it is shown; nothing for one that is not to be seen, or is a height field."""
    kinds, kind = mj.mjtGeom, mj.mjtGeom(model.geom_type[geom])
    material = int(model.geom_matid[geom])
    colour = tuple((model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]).tolist())
    x, y, z = model.geom_size[geom].tolist()
    middle: Vector = (0.0, 0.0, 0.0)
    found: list[tuple[Box | Cylinder | Sphere | Mesh, Vector]] = []
    match kind:
        case kinds.mjGEOM_BOX | kinds.mjGEOM_ELLIPSOID:
            found = [(Box(x, y, z), middle)]
        case kinds.mjGEOM_PLANE:
            found = [(Box(x or PLANE_M, y or PLANE_M, 1e-3), middle)]
        case kinds.mjGEOM_SPHERE:
            found = [(Sphere(x), middle)]
        case kinds.mjGEOM_CYLINDER:
            found = [(Cylinder(x, y), middle)]
        case kinds.mjGEOM_CAPSULE:
            found = [(Cylinder(x, y), middle), (Sphere(x), (0.0, 0.0, y)), (Sphere(x), (0.0, 0.0, -y))]
        case kinds.mjGEOM_MESH:
            found = [_mesh(model, int(model.geom_dataid[geom]), *model.geom_aabb[geom].tolist())]
    pose = pose_of([*model.geom_pos[geom].tolist(), *model.geom_quat[geom].tolist()])
    shown = [
        SceneShape(shape, compose(pose, Transform(IDENTITY.rotation, at)), colour) for shape, at in found
    ]
    return shown if colour[3] > 0.0 else []


def _mesh(model: Any, mesh: int, *aabb: float) -> tuple[Box | Mesh, Vector]:
    first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    if count > MOST_TRIANGLES:
        return Box(*aabb[3:]), (aabb[0], aabb[1], aabb[2])
    corners = model.mesh_vert[int(model.mesh_vertadr[mesh]) :].astype(float)
    faces = model.mesh_face[first : first + count].ravel()
    return Mesh(tuple((x, y, z) for x, y, z in corners[faces].tolist())), (0.0, 0.0, 0.0)
