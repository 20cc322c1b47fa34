"""The books of energy of parts: what they have, what is put in, and what of that is lost for good."""

from __future__ import annotations

from math import dist, hypot
from types import SimpleNamespace

import numpy as np

from iiwa_sim.contact.crowd import PressingBall
from iiwa_sim.contact.crowd_kernel import Crowd
from iiwa_sim.frames import IDENTITY, Transform, compose, multiply, rotate, transpose
from iiwa_sim.handling.falling import FALLS, GONE, HELD, LIES, Body
from iiwa_sim.handling.pressing_kernel import by_the_arm, by_what_is_held, solid_held
from iiwa_sim.handling.pushed_kernel import Known
from iiwa_sim.handling.workpieces import Workpieces
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.capsules import capsules_of
from iiwa_sim.wrench import NO_WRENCH
from tests.handling.scenes import Scene

G = 9.81
ROUNDING_J = 1e-9
"""The energy that there is in a scene, some J, is summed up in another order here."""
_THERE_M = 1e-6
"""What falls and has gone no farther than this is where it lay: nothing falls so slowly."""
_NO_TIME_S = 1e-9
"""A tick in which nothing goes anywhere."""


class Account:
    """What somebody has put in, and what of that is lost: never less than before."""

    def __init__(self, all_j: float) -> None:
        """With so much there (J)."""
        self.work_j = 0.0
        self._first_j = all_j
        self.lost_j = 0.0
        """The most that had been lost."""
        self.returned_j = 0.0
        """The most that came back of that."""

    def look(self, all_j: float) -> float:
        """So much is there now; gives how much of what had been lost has come back."""
        lost_j = self.work_j + self._first_j - all_j
        returned_j = self.lost_j - lost_j
        self.returned_j, self.lost_j = max(self.returned_j, returned_j), max(self.lost_j, lost_j)
        return returned_j


class Books:
    """Of all parts of a scene, from now on.

    Parts fall, slide, land, and press on each other; arm and surfaces put in work. What is lost, by friction
    and landing, is that work less what all have more than at the beginning, and must never become less.
    """

    def __init__(self, scene: Scene, *, carried: bool = False) -> None:
        """With what is `carried` counted among them, or as somebody else's."""
        self.scene = scene
        self._carried = carried
        pieces = scene.handling.workpieces
        assert pieces is not None
        self.pieces: Workpieces = pieces
        description = scene.robot.description
        self._moved_by = {each.link: each.joints for each in capsules_of(description)}
        self._joints = scene.controller.joints
        self._torques = scene.controller.load.exact_torques(self._joints)
        self._touched = self._touches()
        self._probe = Crowd(len(pieces.bodies), _NO_TIME_S)
        self._seen = -1
        self._lay: dict[str, tuple[float, float, float]] = {}  # how high, on which spring, below which height
        self._pressed: object = None
        self.work_j = 0.0
        """What arm and surfaces have put in, and whoever takes parts away or brings them."""
        self.arm_j = 0.0
        """What the arm has done to parts, there and back."""
        self.parts: dict[str, float] = {}
        """What each part has by itself (J)."""
        self.stored_j = 0.0
        """In the springs between parts, walls and arm."""
        held = self.pieces.in_jaws
        self._held = "" if held is None else held.part.name
        self._held_pose = IDENTITY if held is None else held.pose
        self._held_in = IDENTITY if held is None else held.in_tcp
        self._count()
        self._first_j = self._all()
        self.lost_j = 0.0
        """The most that had been lost."""
        self.returned_j = 0.0
        """The most that came back of that."""
        self.but_held = Account(self._all_but_held())
        """Of the parts that are not held: what is held is the arm's, and works by what acts on it, as it is
        when a tick has ended."""
        self.told = ""
        """Where that was first more than rounding."""

    def step(self) -> None:
        """A tick, with the arm's work in it, by what it feels when the tick has ended; where nothing touches,
        by the mean of that and what it felt before."""
        self._tick()
        self.look()

    def step_with_work(self, most_j: float, ticks: int = 1) -> None:
        """Ticks in which surfaces that move do so much work, at the most."""
        for _ in range(ticks):
            self._tick()
        before, all_j = self.parts, self._all()
        self._count()
        others = before.keys() ^ self.parts.keys()  # that jaws have let go of, or hold now, is nobody's work
        changed_j = self._all() - all_j
        self.work_j += changed_j
        did_j = changed_j - sum(self.parts.get(name, 0.0) - before.get(name, 0.0) for name in others)
        assert did_j <= most_j, f"surfaces that can do {most_j:.3g} J of work have brought {did_j:.3g} J"

    def _tick(self) -> None:
        scene = self.scene
        scene.robot.step()
        now = scene.controller.joints
        torques = ending = scene.controller.load.exact_torques(now)
        touched, self._touched = self._touched, self._touches()
        # What is carried is accelerated all along the tick; where it is not counted, jaws may have let go.
        if self._carried and not touched and not self._touched:
            torques = tuple(0.5 * (a + b) for a, b in zip(ending, self._torques, strict=True))
        self._torques = ending
        at_surfaces = self._at_surfaces(now)
        did_j = -sum(
            (t - s) * (a - b) for t, s, a, b in zip(torques, at_surfaces, now, self._joints, strict=True)
        )
        self.work_j += did_j
        self.arm_j += abs(did_j)
        if self._carried:
            self.but_held.work_j += self._by_links(now) + self._by_what_is_held()
        self._joints = now

    def _by_links(self, now: Joints) -> float:
        """Work (J) of the arm in this tick, with its links, tool and jaws, on all that it touches."""
        load, pieces = self.scene.controller.load, self.pieces
        load.hand(NO_WRENCH, NO_WRENCH)
        torques = load.exact_torques(now)
        load.hand(pieces.wrench, pieces.weight)
        at_surfaces = self._at_surfaces(now)
        return -sum(
            (t - s) * (a - b) for t, s, a, b in zip(torques, at_surfaces, now, self._joints, strict=True)
        )

    def _at_surfaces(self, now: Joints) -> list[float]:
        """What of the torques (Nm) at joint positions (rad) surfaces make: that is nobody's work here."""
        controller = self.scene.controller
        load, tcp = controller.load, controller.tcp()
        torques = self.scene.robot.model.tcp(controller.tool_in_flange).torques
        total = np.array(torques(now, load.felt().wrenches[0]))
        back = transpose(tcp.rotation)
        for link, surface, point, force in load.link_contacts:
            if surface in load.world.surfaces:
                lever = np.subtract(point, tcp.translation)
                moment = tuple(np.cross(lever, force).tolist())
                count = self._moved_by.get(link, len(now))  # what is worn is moved by all of them
                made = torques(now, (*rotate(back, force), *rotate(back, moment)))
                total[:count] += made[:count]
        found: list[float] = total.tolist()
        return found

    def _by_what_is_held(self) -> float:
        """Work (J) of what is held in this tick, on all that it touches."""
        held = self.pieces.in_jaws
        if held is None:
            return 0.0
        # It was felt there, and has slid in the jaws since.
        now = compose(self.scene.controller.tcp(), self._held_in)
        before, self._held_pose, self._held_in = self._held_pose, now, held.in_tcp
        x, y, z = (a - b for a, b in zip(now.translation, before.translation, strict=True))
        r = multiply(now.rotation, transpose(before.rotation))
        way = (x, y, z, 0.5 * (r[7] - r[5]), 0.5 * (r[2] - r[6]), 0.5 * (r[3] - r[1]))
        return -sum(f * w for f, w in zip((*held.touching.force, *held.touching.torque), way, strict=True))

    def _all_but_held(self) -> float:
        return self._all() - self.parts.get(self._held, 0.0)

    def _touches(self) -> bool:
        """Whether the arm feels anything, or something acts on what is held."""
        held = self.pieces.in_jaws
        return bool(self.scene.controller.load.link_contacts) or (held is not None and held.touching.pushed)

    def look(self) -> None:
        """Count all anew: nothing may have come from nowhere."""
        before, stored_j = self.parts, self.stored_j
        self._count()
        for name in before.keys() - self.parts.keys():  # held, or gone: somebody has it now
            self.work_j -= before[name]
        for name in self.parts.keys() - before.keys():
            self.work_j += self.parts[name]
        if self._held and self.pieces.held != self._held:  # the jaws have lost it
            self.but_held.work_j += self.parts.get(self._held, 0.0)
            self._held = ""
        self.but_held.look(self._all_but_held())
        lost_j = self.work_j + self._first_j - self._all()
        returned_j = self.lost_j - lost_j
        self.returned_j = max(self.returned_j, returned_j)
        if returned_j > ROUNDING_J and not self.told:
            more = {name: self.parts[name] - before.get(name, 0.0) for name in self.parts}
            changed = ", ".join(f"{name} {value:+.3g}" for name, value in more.items() if value)
            self.told = (
                f"tick {len(self.scene.robot.joints) - 1}: {returned_j:.3g} J from nowhere; "
                f"{changed or 'no part'}, springs {self.stored_j - stored_j:+.3g}"
            )
        self.lost_j = max(self.lost_j, lost_j)

    def brings(self) -> float:
        """Somebody has put in the difference: a surface that rises, a state that is restored. Gives that."""
        before = self._all()
        self._count()
        self.work_j += self._all() - before
        return self._all() - before

    def _all(self) -> float:
        return sum(self.parts.values()) + self.stored_j

    def _count(self) -> None:
        pieces, joints = self.pieces, self.scene.controller.joints
        if pieces.changes != self._seen:
            bodies = pieces.bodies.values()
            there = (each for each in bodies if each.state != GONE and (self._carried or each.state != HELD))
            self.parts = {each.part.name: self._of(each) for each in there}
            self._seen = pieces.changes
        presses = bool(self.scene.controller.load.link_contacts) or self._holds_near()
        lying = [pieces.bodies[name] for name in pieces.lying]
        if (lying, joints if presses else ()) != self._pressed:
            self.stored_j = self._stored()
            self._pressed = lying, joints if presses else ()

    def _holds_near(self) -> bool:
        """Whether what is held may touch a part that lies."""
        held, pieces = self.pieces.in_jaws, self.pieces
        if held is None or not self._carried:
            return False
        at, far = held.pose.translation, held.part.shape.extent + 1e-3
        lying = (pieces.bodies[name] for name in pieces.lying)
        return any(dist(at, each.pose.translation) < far + each.part.shape.extent for each in lying)

    def _moves(self, body: Body) -> tuple[float, float]:
        """Squares of the speeds of its middle (m/s), and about the vertical (rad/s), with what carries it.

        Of what is carried each motion counts for itself, as the crowd has it: how it slides on what carries
        it, how that goes, and how it goes round that.
        """
        fast, turns = 0.0, 0.0
        at = body.pose.translation
        each: Body | None = body
        while each is not None:
            x, y, _ = (a - b for a, b in zip(at, each.pose.translation, strict=True))
            held = self.pieces.in_jaws if each.state == HELD else None
            velocity = each.velocity if held is None else held.velocity
            fast += sum(v * v for v in velocity) + (x * x + y * y) * each.spin**2
            turns += each.spin**2
            each = self._below(each)
        return fast, turns

    def _below(self, body: Body) -> Body | None:
        """The part that carries one that lies, if any."""
        below = self.pieces.bodies.get(body.on) if body.state == LIES else None
        return below if below is not None and below.state == LIES else None

    def _of(self, body: Body) -> float:
        """Of motion, of height, and of the springs of what it lies on (J)."""
        part = body.part
        fast, turns = self._moves(body)
        moments = part.moments(Transform(body.pose.rotation, IDENTITY.translation))
        total = 0.5 * part.mass_kg * fast + 0.5 * (moments.xx + moments.yy) * turns
        total += part.mass_kg * G * body.pose.translation[2]
        face = self.pieces.face_below(part.name) if body.state == LIES else None
        if face is not None:
            soft = face.stiffness_below(part)
            self._lay[part.name] = body.pose.translation[2], soft, face.top
            total += 0.5 * soft * max(0.0, face.top - body.bottom) ** 2
            total += 0.125 * soft * sum(each * each for each in body.wound)
        elif body.state in (LIES, FALLS):  # what it lay on falls, or it may find no room, and lie there again
            at_m, soft, top_m = self._lay.get(part.name, (0.0, 0.0, 0.0))
            if abs(body.pose.translation[2] - at_m) < _THERE_M:
                total += 0.5 * soft * max(0.0, top_m - body.bottom) ** 2
        return total

    def _stored(self) -> float:
        """What a crowd says is stored that knows the same, in a tick that takes no time."""
        pieces, probe = self.pieces, self._probe
        probe.restore(pieces.crowd.kept())
        bodies = {
            name: each._replace(velocity=(0.0, 0.0, 0.0), spin=0.0) for name, each in pieces.bodies.items()
        }
        seen = SimpleNamespace(
            bodies=bodies,
            lying=pieces.lying,
            crowd=probe,
            surfaces=pieces.surfaces,
            face_below=pieces.face_below,
            piles=pieces.piles,
            is_below=pieces.is_below,
            lying_changes=0,
            put=set(),
        )
        known = Known(seen)  # type: ignore[arg-type]
        known.look()
        held, solid = pieces.in_jaws, None
        if held is None or not self._carried:
            probe.hold(-1, None)
        else:
            solid = solid_held(held, self.scene.controller.tcp())._replace(pose=self._held_pose)
            probe.hold(known.numbers[held.part.name], solid)
        total = 0.0
        near = self.scene.controller.load.felt().parts
        for name in pieces.lying:
            pressing = self._pressing(name) if name in near else []
            total += sum(map(_rubbed, pressing))  # at what is held the crowd has it
            if held is not None and solid is not None:
                number = known.numbers[held.part.name]
                pressing += by_what_is_held(held, number, solid, pieces.bodies[name])
            probe.look(known.numbers[name], pressing)
        probe.push([known.numbers[name] for name in pieces.lying])
        return total + float(probe.stored_j)

    def _pressing(self, name: str) -> list[PressingBall]:
        controller = self.scene.controller
        links, part = controller.load.surround(controller.joints), self.pieces.bodies[name].part
        return by_the_arm(part, links, controller.joints, controller.tick_s)


def _rubbed(ball: PressingBall) -> float:
    """Stored in the friction's spring of what the arm presses with (J)."""
    x, y, z = ball.rubbed
    return 0.5 * ball.holding * hypot(x, y, z) ** 2
