"""Scenes: a user's MJCF, and wires between its sensors and actuators and inputs and outputs."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import mujoco as mj
import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import IDENTITY, Transform, compose
from iiwa_sim.world.build import pose_of
from iiwa_sim.world.details import ALL, PARTS
from iiwa_sim.world.part import Mesh

OF_SCENE = 16
"""Collision bits of a scene are so many places higher: the lower ones are those of parts, surfaces, arms."""
MOST_TRIANGLES = 5000
"""A mesh of more is shown as its bounding box."""


SceneShape = tuple[Box | Cylinder | Sphere | Mesh, Transform, tuple[float, ...]]
"""A geom as it is shown: its shape, its pose in its body, and its colour, red green blue opacity."""


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
        mj.set_mju_user_warning(lambda _: None)  # it would write into a file in the working directory
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # options of the scene do not count
            self.spec, self.model = _attached(mj.MjSpec.from_file(str(file.resolve())))
        model, self._conveyors = self.model, dict[str, tuple[float, ...]]()
        self.sensors = _names(model, "sensor", model.nsensor)
        self.cameras = _names(model, "camera", model.ncam)
        self.body_names = _names(model, "body", model.nbody)
        self.bodies = _bodies(model)
        """The bodies that are shown; those fixed to the world come first."""
        self._actuators = _names(model, "actuator", model.nu)
        for name in _names(model, "geom", model.ngeom):
            v = model.geom_surfacevel[model.geom(name).id]
            if v.any():  # at a speed of 1 m/s, or 1 rad/s where it only turns
                speed = float(np.linalg.norm(v[:3])) or float(np.linalg.norm(v[3:]))
                self._conveyors[name] = tuple((v / speed).tolist())
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
        # The same groups as in MuJoCo's own viewer.
        shown = [geom for geom in range(first, first + count) if 0 <= model.geom_group[geom] < 3]
        shapes = tuple(each for geom in shown if (each := _shape(model, geom))[2][3] > 0.0)
        if shapes:
            found.append(SceneBody(names[number], number, shapes))
    return tuple(found)


def _shape(model: Any, geom: int) -> SceneShape:
    """Return a geom as shown: a capsule has flat ends, a geom without a shape of ours is its bounding box."""
    kinds, material, mesh = mj.mjtGeom, int(model.geom_matid[geom]), int(model.geom_dataid[geom])
    colour = tuple((model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]).tolist())
    pose = pose_of([*model.geom_pos[geom].tolist(), *model.geom_quat[geom].tolist()])
    x, y, _ = model.geom_size[geom].tolist()
    match mj.mjtGeom(model.geom_type[geom]):
        case kinds.mjGEOM_PLANE:
            return Box(x or 2.0, y or 2.0, 1e-3), pose, colour
        case kinds.mjGEOM_SPHERE:
            return Sphere(x), pose, colour
        case kinds.mjGEOM_CYLINDER:
            return Cylinder(x, y), pose, colour
        case kinds.mjGEOM_CAPSULE:
            return Cylinder(x, x + y), pose, colour
        case kinds.mjGEOM_MESH if model.mesh_facenum[mesh] <= MOST_TRIANGLES:
            first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            corners = model.mesh_vert[int(model.mesh_vertadr[mesh]) :].astype(float)
            found = corners[model.mesh_face[first : first + count].ravel()].tolist()
            return Mesh(tuple((x, y, z) for x, y, z in found)), pose, colour
    mx, my, mz, x, y, z = model.geom_aabb[geom].tolist()
    return Box(x, y, z), compose(pose, Transform(IDENTITY.rotation, (mx, my, mz))), colour
