"""The parts of a cell, and the gripper that picks them, tick by tick."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from iiwa_sim.contact.crowd_kernel import Crowd
from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.handling.falling import FALLS, GONE, HELD, LIES, STILL, Body, landed, moved, sag
from iiwa_sim.handling.grip import ROUNDING_M, Between, Grasp, between_pads, room_of
from iiwa_sim.handling.gripper import Gripper
from iiwa_sim.handling.ground import grounds_of
from iiwa_sim.handling.held_kernel import Held, Slip
from iiwa_sim.handling.lying import Lying, pressed_into, taken_along
from iiwa_sim.handling.part import Y
from iiwa_sim.handling.riding import after_surfaces, height


class Parts(NamedTuple):
    """All that is to be kept of the parts at rest."""

    bodies: tuple[Body, ...] = ()
    held: Transform | None = None
    """The pose of the held one in the TCP."""
    slip: Slip = (0.0, 0.0)
    felt: object = None
    """What it touches, and what that remembers of it."""
    met: object = None
    """What parts that lie remember of each other."""
    squeezed: tuple[str, ...] = ()
    """The names of those that stand in a row between the jaws, which hold none of them."""
    lost: str = ""
    """The name of one that the jaws have lost, and cannot hold until they have opened."""


class Workpieces(Lying):
    """What becomes of the parts: they lie, are gripped and carried, slip, fall and come to rest."""

    def __init__(
        self, bodies: Iterable[Body], surfaces: Sequence[Surface], gripper: Gripper, tick_s: float
    ) -> None:
        """Parts where they are at the beginning, and what stands round them."""
        super().__init__(bodies, surfaces, gripper)
        self._tick_s = tick_s
        self._closing_on: tuple[tuple[Transform, int], list[Between]] | None = None  # when, and on what
        self.squeezed: tuple[str, ...] = ()
        """The names of those that have stopped the jaws in a row, in which none is held."""
        self._lively = {name for name, each in self._bodies.items() if not each.settled}
        self.crowd = Crowd(len(self._bodies), tick_s)
        """How they push each other."""

    @property
    def bodies(self) -> dict[str, Body]:
        """The parts, by their names."""
        held, bodies = self._held, self._bodies
        if held is not None and bodies[held.part.name].pose is not held.pose:
            bodies[held.part.name] = Body(held.part, held.pose, STILL, HELD)
        return bodies

    def put_aside(self, body: Body) -> None:
        """A part has been pushed."""
        name = body.part.name
        self._put(body)
        self._look_again()
        if body.settled:
            self._lively.discard(name)
        else:
            self._lively.add(name)
        if body.state != LIES:
            self.pushed.update(each.part.name for each in self.riders(name))
            self._unsettle(name, body.velocity)

    def surfaces_are(self, surfaces: Sequence[Surface]) -> None:
        """What stands there from now on: parts ride up with what they lie on, and fall where it goes from
        below them; what is in the air comes to lie on what comes up to it from below."""
        before = self._level()
        self._surfaces = tuple(surfaces)
        self._grounds = self._round = None
        self.changes += 1  # what is pressed against them may go on
        self._look_again()
        for now in list(after_surfaces(self._bodies.values(), before, grounds_of(self._surfaces))):
            self._put(now)
            self._note_lying()  # elsewhere than before
            if now.state != LIES:
                self._lively.add(now.part.name)

    def grip(self, tcp: Transform, was_m: float) -> float:
        """Jaws that were `was_m` apart close to where they are now, with the TCP at this pose: parts between
        them are pushed together. One that fills the room between them is held; several in a row stop them,
        and none of these is. Gives how far apart the jaws are kept (m), 0 for not at all."""
        squeezed, self.squeezed = self.squeezed, ()
        found = [
            each
            for each in self._between_pads(tcp)
            if each.name in squeezed or (each.name != self._lost and each.outermost_m <= was_m + ROUNDING_M)
        ]
        room, now_m = room_of(found), self._gripper.opening_m
        widest = max(found, key=lambda each: room[each.name].all_m, default=None)
        kept_m = 0.0 if widest is None else room[widest.name].all_m
        if widest is not None and now_m <= kept_m:
            if kept_m == widest.width_m:  # nothing is beside it
                self._grasp(widest, tcp)
                return kept_m
            self.squeezed = tuple(room)
            now_m = kept_m = min(kept_m, was_m)
        least_m = ROUNDING_M if self.squeezed else 0.0  # what stands in a row rests there
        for each in found:
            way_m = room[each.name].way(each.in_tcp.translation[Y], now_m)
            if abs(way_m) > least_m:
                self._push(each.name, self.bodies[each.name], tcp, way_m)
        return kept_m if self.squeezed else 0.0

    @property
    def squeezes(self) -> bool:
        """Whether jaws squeeze several parts in a row, and do so on as long as the TCP stays."""
        seen = self._closing_on
        return bool(self.squeezed) and seen is not None and seen[0] == (self._tcp, self.changes)

    def _grasp(self, it: Between, tcp: Transform) -> None:
        """The jaws have just closed on a part."""
        before, face = self.bodies[it.name], self.face_below(it.name)
        held = self._take(it.name, it.in_tcp, tcp)
        below_m = 0.0 if face is None else max(0.0, face.top - before.bottom) + ROUNDING_M
        held.touching.come_down(held.pose, below_m, self._all_solid, self._tick_s)
        if self._tcp is not None and (tcp != self._tcp or before.velocity != STILL):
            held.catch(Grasp(tcp, self._tcp, before.velocity))

    def _between_pads(self, tcp: Transform) -> list[Between]:
        """Parts between the pads, with the TCP there: found anew where it or a part is elsewhere."""
        now = tcp, self.changes
        if self._closing_on is None or self._closing_on[0] != now:
            there = ((each.part, each.pose) for each in self.bodies.values() if each.state != GONE)
            self._closing_on = now, between_pads(there, tcp, self._gripper)
        return self._closing_on[1]

    def _move_lively(self) -> None:
        for each in sorted((self._bodies[name] for name in self._lively - self.pushed), key=height):
            self._move(each.part.name)

    def _let_go(self) -> None:
        """What is held goes on as fast as it is."""
        held = self._held
        if held is None:
            return
        name, body = held.part.name, self.bodies[held.part.name]
        onto = pressed_into(body, self._grounds_but(name), held.touching.pressed_from_above)
        self._held = None
        x, y, z = held.pose.translation
        up = self._springs_back(onto, held.part.mass_kg)
        pose = held.pose._replace(translation=(x, y, z + up)) if up else held.pose
        self._put(Body(held.part, pose, held.velocity, FALLS, onto))
        self._lively.add(name)

    def _springs_back(self, name: str, more_kg: float) -> float:
        """A part that nothing presses down any more rises, with what lies on it and `more_kg`, to where it
        would lie by itself; returns how far (m). It stays where its spring cannot lift all that, or the arm
        presses on it."""
        body = self._bodies.get(name)
        if body is None or body.state != LIES or not body.settled:
            return 0.0
        riders = self.riders(name)
        more_kg += sum(each.part.mass_kg for each in riders)
        up_m = self._springs_back(body.on, more_kg + body.part.mass_kg)
        body, face = self._bodies[name], self.face_below(name)
        assert face is not None
        rests = landed(body, face)
        rises_m = rests.bottom - body.bottom
        soft, sags_m = face.stiffness_below(body.part), sag(body.part, face)
        stored_j = 0.5 * soft * rises_m * (rises_m + 2.0 * sags_m)
        lifts_j = (body.part.mass_kg + more_kg) * GRAVITY_M_S2 * rises_m
        if rises_m <= ROUNDING_M or stored_j < lifts_j or self._number(name) in self.crowd.pressed:
            return up_m
        self.put_aside(rests)
        for each in riders:
            now = self._bodies[each.part.name]
            x, y, z = now.pose.translation
            self.put_aside(now._replace(pose=now.pose._replace(translation=(x, y, z + rises_m))))
        return up_m + rises_m

    def remove(self, name: str) -> None:
        """Take a part away."""
        if name == self.held:
            self._let_go()
        self._put(self._bodies[name]._replace(state=GONE, velocity=STILL, on=""))
        self._lively.discard(name)
        self._unsettle(name)

    def kept(self) -> Parts:
        """All that is to be kept."""
        held, bodies = self._held, tuple(self.bodies.values())
        kept = Parts(bodies, met=self.crowd.kept(), squeezed=self.squeezed, lost=self._lost)
        return kept if held is None else kept._replace(held=held.in_tcp, slip=held.slip, felt=held.felt())

    def restore(self, parts: Parts, tcp: Transform, surfaces: Sequence[Surface]) -> None:
        """Bring that back, among these surfaces, with the TCP at rest at a pose."""
        self._held, self._tcp = None, tcp
        self.squeezed, self._lost = parts.squeezed, parts.lost
        self._bodies = {each.part.name: each for each in parts.bodies}
        self._note_all()
        if parts.met is not None:
            self.crowd.restore(parts.met)
        self.changes += 1
        self._surfaces = tuple(surfaces)
        self._solid = self._grounds = self._round = None
        self._lively = {name for name, each in self._bodies.items() if not each.settled}
        for name, each in self._bodies.items():
            if each.state == HELD and parts.held is not None:
                held = self._take(name, parts.held, tcp)
                held.rest(tcp, self._all_solid, parts.slip)
                if parts.felt is not None:
                    held.feel_again(parts.felt)

    def tcp_is(self, tcp: Transform) -> None:
        """The robot has been put somewhere, at rest, and what it holds with it."""
        self._tcp = tcp
        if self._held is not None:
            self._held.rest(tcp, self._all_solid)
            self.changes += 1

    def _take(self, name: str, in_tcp: Transform, tcp: Transform) -> Held:
        """Hold it from now on."""
        self._held = held = Held(self._bodies[name].part, in_tcp, tcp, self._gripper, self._tick_s)
        self._lively.discard(name)
        self._put(Body(held.part, held.pose, STILL, HELD))
        self._unsettle(name)
        return held

    def _look_again(self) -> None:
        """What may be touched is not what it was."""
        self._solid = None
        if self._held is not None:
            self._held.look_again()

    def _unsettle(self, name: str, velocity: Vector = STILL) -> None:
        """What lies on a part, and on that, falls, as fast (m/s) as that."""
        self._look_again()
        for each in self.riders(name):
            fast = each.velocity if velocity == STILL else velocity
            self._put(each._replace(state=FALLS, velocity=fast, spin=0.0, wound=(), on=""))
            self._lively.add(each.part.name)

    def _push(self, name: str, each: Body, tcp: Transform, way_m: float) -> None:
        """A jaw pushes a part that is not held, along y of the TCP."""
        r, (x, y, z) = tcp.rotation, each.pose.translation
        up = 0.0 if each.state == LIES else way_m * r[7]
        pose = Transform(each.pose.rotation, (x + way_m * r[1], y + way_m * r[4], z + up))
        if each.state == LIES:  # perhaps over an edge
            each = each._replace(state=FALLS, spin=0.0, wound=())
            self._lively.add(name)
        self._put(each._replace(pose=pose))
        self._unsettle(name)

    def _number(self, name: str) -> int:
        """The number of a part in the crowd."""
        return self._piles.numbers[name]

    def _move(self, name: str) -> None:
        """A tick of a part that falls or slides."""
        each = self._bodies[name]
        beside = self._beside(name)
        after = moved(each, self._grounds_but(name, beside), self._tick_s, beside)
        if after.state == LIES and (each.state, each.on) != (LIES, after.on):
            after, slowed = self._shares(after)
            for below in slowed:
                self._put(below)
            self.crowd.parted(self._number(name))
        self._put(after)
        if after.settled:
            self._lively.discard(name)
            self._look_again()
        if each.state == after.state == LIES and after.on == each.on:
            for rider in self.riders(name):
                self._put(taken_along(rider, each, after))
        elif each.on or after.pose != each.pose:
            self._unsettle(name, each.velocity)
