"""The bodies of a cell in MuJoCo, tick by tick, beside arms whose motion is imposed.

A tick integrates the parts under the last forces, puts the arms where their plans have brought them,
and finds the forces there. Forces therefore belong to the poses of this tick.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import mujoco as mj
import numpy as np

from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform, compose
from iiwa_sim.wording import harmless
from iiwa_sim.world import details
from iiwa_sim.world.arm import NOWHERE, Arm, travel_m
from iiwa_sim.world.build import ArmSetup, WorldModel, build, pose_of, wxyz
from iiwa_sim.world.details import Vector, find_forces
from iiwa_sim.world.distances import Distances
from iiwa_sim.world.material import law_of_free
from iiwa_sim.world.part import FALLS, GONE, HELD, LIES, Part
from iiwa_sim.world.tick_kernel import ROOM_M, brake, measure_free

REMOVED = "part {!r} is gone: made to through the backdoor"
FARTHEST_M = 10.0
"""A part that falls or rolls farther from the origin along an axis is gone."""
STILL_TICKS, SLOW_M_S, STILL_M = 50, 5e-5, 1e-4
"""Parts that stay within this for so many ticks, or are slow for a fifth of that, stand still."""
SPINS_RAD_S = 2.0
"""An explicit step, which is cheaper, would make bodies that turn faster tumble faster and faster."""


class World:
    """Bodies of a cell: a scene, surfaces, parts, and arms with their grippers.

    For each tick, `Arm.go` sets where each arm goes, then `step` makes the tick. Each arm then has the
    forces on it: `wrench`, `push`, `torques` and `contacts`.

    A scene is an `MjSpec`; numbers of its bodies, geoms, joints, actuators and sensors are those of `model`,
    in which they come first. Sensors are read in each tick. Changes to `model` or `data` from outside need
    `wake`. They are lost when surfaces or tools change the model, except for controls and states of bodies.
    """

    def __init__(
        self,
        arms: Sequence[ArmSetup],
        surfaces: Sequence[Surface],
        parts: Sequence[tuple[Part, Transform]],
        scene: Any,
        tick_s: float,
    ) -> None:
        """The arms are at rest; surfaces and parts are in the world's frame."""
        self.tick_s, self._scene = tick_s, scene
        self.law = law_of_free(tick_s)
        self.parts, self._start = [part for part, _ in parts], list(parts)
        self.surfaces = tuple(surfaces)
        self.changes = 0
        """Counts up when a part may have another pose or state."""
        self._gone: set[int] = set()
        self.behind = False
        """True if the model is not where the arms are, since ticks were not computed."""
        self.quiet = self._frozen = False
        self._still, self._spin = 0, 0.0
        self._distances: Distances | None = None
        self.data: Any = None
        self.arms = [Arm(self, number, arm) for number, arm in enumerate(arms)]
        self.rebuild()
        self._still_q: Vector = np.zeros((len(self.parts), 7))
        self.wake()

    @property
    def settled(self) -> bool:
        """True if ticks change nothing as long as the arms stay where they are, and outputs as they are."""
        return (self._frozen or self.quiet) and all(arm.stands for arm in self.arms)

    def pose(self, number: int) -> Transform:
        """Return the pose of a part in the world."""
        arm = self.leader(number)
        at = pose_of(self.part_q[number].tolist()) if arm is None else compose(arm.tcp, arm.inside)
        return compose(at, self._built.offsets[number])

    def leader(self, number: int) -> Arm | None:
        """Return the arm that imposes the motion of a part; None for a free part."""
        return next((arm for arm in self.arms if arm.leads and arm.held == number), None)

    def state(self, number: int) -> str:
        """Return the state of a part: lies, falls, held or gone."""
        if number in self._gone:
            return GONE
        if self.leader(number) is not None:
            return HELD
        data = self.data
        rests = data.body_awake[self.bodies[number]] == 0 or self.geoms[number] in data.contact.geom
        return LIES if rests else FALLS

    def apart(self, one: int, two: int) -> float:
        """Return the distance (m) of two geoms."""
        return float(mj.mj_geomDistance(self.model, self.data, one, two, 1.0, None))

    def overlaps(self, deeper_m: float) -> list[tuple[float, str, str]]:
        """Return the depth (m) and names of `touchable` of each two that are deeper in each other, sorted."""
        contact, names = self.data.contact, self.touchable
        found = zip((-contact.dist).tolist(), contact.geom.tolist(), strict=True)
        return sorted((depth, names[one], names[two]) for depth, (one, two) in found if depth > deeper_m)

    # A tick

    def step(self) -> None:
        """Make a tick, after `Arm.go` of each arm."""
        arms, away = self.arms, self._distances is not None
        for arm in arms:
            arm.begin()
            away = away and min(arm.bounds[:3].tolist()) >= ROOM_M
            self.quiet = self.quiet and arm.bears and arm.lost < 0
        if self._frozen and all(arm.stands for arm in arms):
            return
        if any(arm.leads for arm in arms):
            self.changes += 1
        if self.quiet and (away or self.is_away()):
            for arm in arms:
                if not self.behind:
                    arm.rest()
                arm.skip()
            self.behind = True
            return
        self._compute()

    def is_away(self) -> bool:
        """Measure distances where bounds are too low; return True if the arms meet nothing in this tick."""
        far, arms, rooms = self._distances, self.arms, [arm.bounds[:7].tolist() for arm in self.arms]
        if far is None:
            self.catch_up(now=False)
            far = self._distances = Distances(self.model, self.data, self._movers())
            for number, room in enumerate(rooms):
                room[:3], room[6] = (0.0, 0.0, 0.0 if len(arms) > 1 else np.inf), far.reach_m[number]
        for number, room in enumerate(rooms):
            for k, moved_m in enumerate(travel_m(room)[:2]):
                if room[k] < ROOM_M + 2.0 * moved_m:
                    self.catch_up(now=False)
                    room[k] = far.least(self.model, self.data, 2 * number + k) - moved_m
        if any(room[2] < ROOM_M for room in rooms):
            self.catch_up(now=False)
            half_m = 0.5 * far.least(self.model, self.data, 2 * len(arms))
            for room in rooms:
                room[2] = half_m - travel_m(room)[2]
        for arm, room in zip(arms, rooms, strict=True):
            arm.bounds[:7] = room
        return all(min(room[:3]) >= ROOM_M for room in rooms)

    def _movers(self) -> list[tuple[list[int], list[int], int]]:
        """Return for each arm geoms of links, geoms that move with its gripper, and the gripper's body."""
        found, body_of = [], self.model.geom_bodyid
        for arm, numbers in zip(self.arms, self._built.arms, strict=True):
            links = [geom for geom in numbers.touching if body_of[geom] < numbers.gripper]
            tool = [geom for geom in numbers.touching if body_of[geom] >= numbers.gripper]
            held = [self.geoms[arm.held]] if arm.leads else []
            found.append((sorted(links), [*sorted(tool), *held], numbers.gripper))
        return found

    def _compute(self) -> None:
        self.catch_up(now=False)
        model, data, arms = self.model, self.data, self.arms
        if model.nu or self._spin > SPINS_RAD_S:
            mj.mj_implicit(model, data)
        else:
            mj.mj_Euler(model, data)
        self._spin = brake(self.part_v, self.tick_s)
        self._impose()
        self._find_forces()
        near, speed, far_m = measure_free(self.part_q, self.part_v, self._still_q, STILL_M)
        if far_m > FARTHEST_M:
            for number in np.nonzero((np.abs(self.part_q[:, :3]) > FARTHEST_M).any(axis=1))[0].tolist():
                self._take_away(number)
        self.changes += 1
        # A scene's sensors may see what an arm does anywhere.
        quiet = not model.nsensor and details.is_quiet(data, 2 * len(arms) + sum(arm.leads for arm in arms))
        if not (quiet and self.quiet):
            self._distances = None
        self.quiet = quiet and all(arm.slip == NOWHERE for arm in arms)
        # A body of a scene that a servo moves slowly does not stand, nor one that an activation may move.
        moves = max(np.abs(self._scene_v).max(initial=0.0), np.abs(data.act_dot).max(initial=0.0))
        near = near and moves <= SLOW_M_S
        if not (near and all(arm.stands for arm in arms)):
            self._still = 0
            self._still_q[:] = self.part_q
        self._still += 5 if self._still and speed < SLOW_M_S else 1
        self._frozen = self._still > STILL_TICKS
        if self._frozen:
            self.part_v[:] = 0.0

    def _impose(self) -> None:
        """Give arms, grippers and held parts the pose and velocity of this tick."""
        arms, q, before = self.arms, self.data.qpos, self.q_was
        for arm in arms:
            arm.slides(before)
            arm.place_in(q, arm.joints, arm.tcp)
        for arm in arms:
            arm.move_jaws(computed=True)
        now = self.velocity(before, q)
        before[:] = q
        for arm in arms:
            arm.impose(now)

    def velocity(self, before: Vector, now: Vector) -> Vector:
        """Return the velocities of all dofs, between positions a tick apart."""
        v = np.zeros(self.model.nv)
        mj.mj_differentiatePos(self.model, v, self.tick_s, before, now)
        return v

    def _find_forces(self) -> None:
        """Find the forces at the present poses, and pass them to the arms."""
        built = self._built
        find_forces(built.model, self.data, built.points, built.kinds, self.tick_s)
        for arm in self.arms:
            arm.take_forces()

    # Parts

    def set_bits(self, number: int) -> None:
        """Set the bodies that a part meets: not the arm that leads it, nor one that has lost it."""
        leader = self.leader(number)
        passed = {arm.bit for arm in self.arms if arm is leader or arm.lost == number}
        if number not in self._gone:
            details.set_passed(self.model, self.geoms[number], sum(passed))

    def remove(self, number: int) -> None:
        """Take a part away."""
        for arm in self.arms:
            if arm.held == number:
                arm.let_go("")
        self._take_away(number)
        self.wake()
        for arm in self.arms:
            arm.report(harmless(REMOVED.format(self.parts[number].name)), False)

    def _take_away(self, number: int) -> None:
        self._gone.add(number)
        details.set_gone(self.model, self.data, self.bodies[number], self.geoms[number])
        self.part_q[number, :3] = 0.0, 0.0, -FARTHEST_M

    # Changes from outside

    def set_surfaces(self, surfaces: Sequence[Surface]) -> None:
        """Replace the surfaces; those that only moved push the parts that they meet."""
        before, self.surfaces = self.surfaces, tuple(surfaces)
        was, now = ([each._replace(pose=IDENTITY) for each in of] for of in (before, self.surfaces))
        if was != now:
            self.rebuild()
        model = self.model
        for at, each in zip(self._built.surfaces.tolist(), self.surfaces, strict=True):
            model.body_pos[at], model.body_quat[at] = each.pose.translation, wxyz(each.pose.rotation)
        self.wake()

    def wake(self) -> None:
        """Compute all bodies again after a change from outside."""
        self.catch_up(now=True)
        details.wake_all(self.model, self.data)
        self.wake_up()
        self._find_forces()

    def wake_up(self) -> None:
        """Compute the next ticks, after a change of what may move."""
        self.changes += 1
        self._distances, self.quiet, self._frozen = None, False, False
        self._still = 0

    def catch_up(self, *, now: bool) -> None:
        """Put the arms where they are, or where they were a tick ago, after ticks that were not computed."""
        if self.behind:
            for arm in self.arms:
                arm.put(*((arm.joints, arm.tcp) if now else (arm.before, arm.tcp_before)))
            self.q_was[:] = self.data.qpos
            mj.mj_kinematics(self.model, self.data)
            self.behind = False

    def kept(self) -> tuple[WorldModel, Any, list[dict[str, Any]]]:
        """Return the state, for `restore`."""
        built = self._built._replace(model=copy.copy(self.model))
        return built, copy.copy(self.data), [_copied(vars(each)) for each in (self, *self.arms)]

    def restore(self, state: tuple[WorldModel, Any, list[dict[str, Any]]]) -> None:
        """Bring a kept state back; the next ticks are the same to the last bit as after it was kept."""
        built, data, kept = state
        for of, fields in zip((self, *self.arms), kept, strict=True):
            vars(of).update(_copied(fields))
        self._bind(built._replace(model=copy.copy(built.model)), copy.copy(data))
        self.changes += 1

    def rebuild(self) -> None:
        """Build the model for the present surfaces and tools; bodies go on from where they are."""
        before, arms = self.data, self.arms
        built = build(
            [arm.setup for arm in arms], self.surfaces, self._start, self.law, self.tick_s, self._scene
        )
        data = mj.MjData(built.model)
        if before is not None:
            for name in ("qpos", "qvel", "act", "ctrl", "eq_active", "mocap_pos", "mocap_quat"):
                getattr(data, name)[:] = getattr(before, name)
            built.model.geom_surfacevel[: len(self.conveyors)] = self.conveyors
            data.qacc_warmstart[:] = before.qacc_warmstart
        self._bind(built, data)
        for number in self._gone:
            details.set_gone(built.model, data, self.bodies[number], self.geoms[number])
        for arm in arms:
            arm.note_imposed()
            arm.put(arm.joints, arm.tcp)
            arm.rest()
        for number in {arm.lost for arm in arms if arm.lost >= 0}:
            self.set_bits(number)
        self.q_was: Vector = data.qpos.copy()

    def _bind(self, built: WorldModel, data: Any) -> None:
        """Take views of the arrays of a model and its data."""
        self._built: WorldModel = built
        self.data, self.model, count = data, (model := built.model), len(self.parts)
        self._scene_v: Vector = data.qvel[: int(model.jnt_dofadr[built.arms[0].hinge])]
        self.part_first, self.part_dof = model.nq - 7 * count, model.nv - 6 * count
        self.part_q: Vector = data.qpos[self.part_first :].reshape(-1, 7)
        self.part_v: Vector = data.qvel[self.part_dof :].reshape(-1, 6)
        self.geoms: list[int] = built.parts.tolist()
        self.bodies: list[int] = model.geom_bodyid[built.parts].tolist()
        self.numbers = {geom: number for number, geom in enumerate(self.geoms)}
        surfaces = dict(zip(built.surfaces.tolist(), (each.name for each in self.surfaces), strict=True))
        scene = {geom: name_in(model, geom) for geom in range(min(built.arms[0].touching))}
        self.conveyors: Vector = model.geom_surfacevel[: len(scene)]  # of the scene
        self.touchable: dict[int, str] = {}
        """Names of geoms that an arm touches."""
        self.kinds: dict[str, str] = {}
        """Kinds of these names: body of the scene, surface, part, or robot for another arm."""
        for kind, names in (
            ("body", scene),
            ("surface", {k: surfaces[at] for k, at in enumerate(model.geom_bodyid) if at in surfaces}),
            ("part", {geom: self.parts[number].name for geom, number in self.numbers.items()}),
            *(
                ("robot", {geom: f"{name} of robot {arm.name!r}" for geom, name in numbers.touching.items()})
                for arm, numbers in zip(self.arms, built.arms, strict=True)
            ),
        ):
            self.touchable |= names
            self.kinds |= dict.fromkeys(names.values(), kind)
        for arm in self.arms:
            arm.bind(built, data)


_SHARED = {"_built", "data", "_start", "_scene", "arms", "changes", "parts"}
_SHARED |= {"world", "_data", "model", "gripper", "report"}
"""Attributes of worlds and arms that a named state does not keep, or copies otherwise."""


def _copied(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: copy.copy(value) for name, value in fields.items() if name not in _SHARED}


def name_in(model: Any, geom: int) -> str:
    """Return the name of a scene's body by one of its geoms; the geom's if it is fixed to the world."""
    body, own = str(model.body(model.geom_bodyid[geom]).name), str(model.geom(geom).name)
    return own or "the scene" if body == "world" else body or own or "the scene"
