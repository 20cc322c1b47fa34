"""Parts in heaps and rows, drawn by a seed, what happens to them, and an arm that goes through them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from math import hypot

import numpy as np

from iiwa_sim.backdoor import surfaces
from iiwa_sim.backdoor.states import States
from iiwa_sim.cell.cell import Cell, robot_alone
from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.handling import HandlingState
from iiwa_sim.frames import IDENTITY, Frame, Rotation, Transform, compose, inverse
from iiwa_sim.handling.falling import FALLS, GONE, HELD, LIES, STILL, Body
from iiwa_sim.handling.grip import grip_width
from iiwa_sim.handling.part import Part, Y, Z
from iiwa_sim.handling.workpieces import Parts
from tests.asked import lin_move
from tests.handling.books import Books, G
from tests.handling.scenes import CLOSE, TABLE, TABLE_MM, Scene, at, down

BEGIN_MM = -260.0
"""Where along y the arm begins to push, beside all parts."""
ABOVE_MM = TABLE_MM + 200.0
REST_TICKS = 5000
SLOW_M_PER_S = 1e-6
SEEN_M_PER_S = 1e-3
LOW_MM = 16.0
UPRIGHT = IDENTITY.rotation
FRICTIONS = (0.1, 0.3, 0.5, 1.0)
Placed = tuple[Part, Transform]


@lru_cache
def above() -> Cell:
    """The robot alone, with its TCP above where parts are."""
    scene = Scene()
    scene.goes(down(600.0, 0.0, ABOVE_MM), straight=False)
    return replace(robot_alone(), start=scene.controller.joints)


def drawn_part(rng: np.random.Generator, name: str, frictions: tuple[float, ...] = FRICTIONS) -> Part:
    """Of 10 to 80 mm, and 0.05 to 2 kg."""
    a, b, c = (10.0 ** rng.uniform(-2.3, -1.4, 3)).tolist()
    shape = (Box(a, b, c), Box(a, a, a), Cylinder(a, b), Sphere(a))[rng.integers(4)]
    mass, stiffness = float(10.0 ** rng.uniform(-1.3, 0.3)), float(10.0 ** rng.uniform(4.0, 5.5))
    return Part(name, shape, mass, float(rng.choice(frictions)), stiffness)


def drawn_turn(rng: np.random.Generator) -> Rotation:
    """Upright, on its side, or anyhow."""
    alpha, beta, gamma = rng.uniform(-3.1, 3.1, 3).tolist()
    angles = ((alpha, 0.0, 0.0), (0.0, 0.0, 0.0), (alpha, 0.0, 0.5 * np.pi), (alpha, beta, gamma))
    return Frame(0.0, 0.0, 0.0, *angles[rng.integers(4)]).to_transform().rotation


def row(rng: np.random.Generator, *, stacks: bool = False) -> list[Placed]:
    """Parts that stand on the table along y, none in another, and perhaps one on some of them."""
    parts: list[Placed] = []
    y_mm, gap_mm = -100.0, drawn_gap(rng)
    for number in range(int(rng.integers(1, 7))):
        part = drawn_part(rng, f"part {number}", (0.0, *FRICTIONS))
        turn = part.laid(drawn_turn(rng))
        half_mm, high_mm = 1e3 * part.reach(turn, Y), 1e3 * part.reach(turn, Z)
        y_mm += half_mm
        x_mm = 600.0 + float(rng.uniform(-20.0, 20.0))
        parts.append((part, _placed(turn, x_mm, y_mm, TABLE_MM + high_mm)))
        upper = drawn_part(rng, f"upper {number}")
        fits = 1e3 * upper.reach(UPRIGHT, Y) <= half_mm
        if stacks and fits and not isinstance(part.shape, Sphere):
            top_mm = TABLE_MM + 2.0 * high_mm + 1e3 * upper.reach(UPRIGHT, Z)
            parts.append((upper, _placed(UPRIGHT, x_mm, y_mm, top_mm)))
        y_mm += half_mm + gap_mm
    return parts


def straight_row(rng: np.random.Generator) -> list[Placed]:
    """Smooth boxes and standing cylinders, each right behind the other, and higher than `LOW_MM`: jaws turn
    none, and lift none."""
    parts: list[Placed] = []
    y_mm, gap_mm = -100.0, drawn_gap(rng)
    for number in range(int(rng.integers(1, 7))):
        part = drawn_part(rng, f"part {number}", (0.0,))
        size, high = part.shape[0], 5e-4 * LOW_MM + max(part.shape[-1], 5e-4 * LOW_MM)
        is_box = isinstance(part.shape, Box)
        part = part._replace(shape=Box(size, part.shape[1], high) if is_box else Cylinder(size, high))
        half_mm = 1e3 * part.reach(UPRIGHT, Y)
        y_mm += half_mm
        parts.append((part, _placed(UPRIGHT, 600.0, y_mm, TABLE_MM + 1e3 * part.reach(UPRIGHT, Z))))
        y_mm += half_mm + gap_mm
    return parts


def drawn_gap(rng: np.random.Generator) -> float:
    """Between parts (mm)."""
    return float(rng.choice([0.01, 0.3, 3.0]))


def heap(rng: np.random.Generator) -> list[Placed]:
    """Parts in the air, and below them some that stand on the table, none in another."""
    wide_mm = float(rng.choice([20.0, 50.0, 100.0]))
    parts: list[Placed] = []
    for number in range(int(rng.integers(2, 9))):
        x_mm, y_mm, above_mm = 600.0 + rng.uniform(-wide_mm, wide_mm), rng.uniform(-wide_mm, wide_mm), 0.0
        part, turn = drawn_part(rng, f"part {number}"), drawn_turn(rng)
        if rng.random() < 0.5:
            turn = part.laid(turn)
        if part.laid(turn) != turn or any(_near(part, x_mm, y_mm, *each) for each in parts):
            above_mm = float(rng.uniform(150.0, 400.0))
        parts.append((part, _placed(turn, x_mm, y_mm, TABLE_MM + 1e3 * part.reach(turn, Z) + above_mm)))
    return parts


def _near(part: Part, x_mm: float, y_mm: float, other: Part, where: Transform) -> bool:
    x, y, _ = where.translation
    return hypot(1e-3 * x_mm - x, 1e-3 * y_mm - y) < part.shape.extent + other.shape.extent


def _placed(turn: Rotation, x_mm: float, y_mm: float, z_mm: float) -> Transform:
    return Transform(turn, (1e-3 * x_mm, 1e-3 * y_mm, 1e-3 * z_mm))


class HeapScene:
    """Parts on a table, and perhaps a tray on it, what happens to them, and the books of their energy."""

    def __init__(self, rng: np.random.Generator, parts: list[Placed], carried: Part | None = None) -> None:
        """With one that is `carried` by the jaws, upright, if any."""
        self._rng = rng
        if carried is not None:
            parts = [*parts, (carried, at(600.0, 0.0, ABOVE_MM))]
        tray = Surface("tray", Box(0.05, 0.05, 0.005), at(600, 30, TABLE_MM - 5.0), 3e4, 0.0, 0.3)
        world = (TABLE, tray) if rng.random() < 0.5 else (TABLE,)
        self.scene = Scene(*parts, surfaces=world, cell=above())
        if carried is not None:
            handling, controller = self.scene.handling, self.scene.controller
            tcp, bodies = controller.tcp(), []
            for each in handling.kept().parts.bodies:
                is_it = each.part is carried
                bodies.append(Body(carried, at(600.0, 0.0, ABOVE_MM), STILL, HELD) if is_it else each)
            in_tcp = compose(inverse(tcp), at(600.0, 0.0, ABOVE_MM))
            width_m = grip_width(carried, in_tcp)
            controller.io.set_output(CLOSE, True)
            handling.restore(HandlingState(width_m, Parts(tuple(bodies), in_tcp)), tcp)
        self.books = Books(self.scene, carried=carried is not None)
        self.fastest = 0.0
        """Of all parts, along the table (m/s)."""

    def step(self, ticks: int = 1) -> None:
        """With the books kept."""
        for _ in range(ticks):
            self.books.step()
            self._note_speed()

    def _note_speed(self) -> None:
        bodies = self.books.pieces.bodies.values()
        self.fastest = max(self.fastest, *(hypot(*each.velocity[:2]) for each in bodies))

    def rests(self) -> None:
        """Until nothing moves but what nothing brakes: what rubs not at all slides on for ever, and what it
        squeezes swings on, below what is seen."""
        for _ in range(REST_TICKS):
            if not any(self.moving()):
                return
            self.step()
        fast = [each for each in self.moving() if hypot(*each.velocity) > SEEN_M_PER_S]
        assert not fast, f"these do not come to rest: {fast}"

    def moving(self) -> list[Body]:
        """The parts that are not at rest, and should be so some time."""
        bodies = self.books.pieces.bodies.values()
        return [each for each in bodies if not each.settled and not _goes_on(each)]

    def falls(self) -> None:
        """All fall, and things happen, until all rests."""
        happens = (self._removes, self._moves_what_is_below, self._lets_go, self._restores)
        for _ in range(int(self._rng.integers(0, 4))):
            self.step(int(self._rng.integers(1, 300)))
            happens[self._rng.integers(len(happens))]()
        self.rests()

    def _removes(self) -> None:
        pieces = self.scene.handling.workpieces
        assert pieces is not None
        there = [name for name, each in pieces.bodies.items() if each.state != GONE]
        if there:
            self.scene.handling.remove(there[self._rng.integers(len(there))])
            self.books.look()

    def _moves_what_is_below(self) -> None:
        """The tray, or else the table, goes somewhere; that what rises with it weighs something is work."""
        rng, controller = self._rng, self.scene.controller
        dx, dy, dz = (rng.normal(size=3) * rng.choice([0.0, 1.0, 20.0], 3)).tolist()
        world = controller.load.world.surfaces
        name = list(world)[-1]
        x, y, z = (1e3 * each for each in world[name].pose.translation)
        with suppress(Refused):
            surfaces.move(controller, name, Frame(x + dx, y + dy, z + dz, 0.0, 0.0, 0.0))
            weight_n = G * sum(each.part.mass_kg for each in self.books.pieces.bodies.values())
            # What stood pressed into something, and comes down with it, is as pressed a few ticks later.
            ticks = 8 if dz < 0.0 else 1
            self.books.step_with_work(1e-3 * max(0.0, dz) * weight_n + 1e-9, ticks)

    def _lets_go(self) -> None:
        """Jaws that have a part above the others open, unless they have not let go of another one yet."""
        if self.books.pieces.held:
            return
        rng, handling, controller = self._rng, self.scene.handling, self.scene.controller
        kept, tcp = handling.kept().parts, controller.tcp()
        there = [each.part.name for each in kept.bodies if each.state != GONE]
        if not there:
            return
        name = there[rng.integers(len(there))]
        in_tcp = _placed(drawn_turn(rng), *rng.uniform(-60.0, 60.0, 2).tolist(), 0.0)
        where, ticks = compose(tcp, in_tcp), int(rng.integers(1, 20))
        if self._may_push(name, where, tcp):
            return
        bodies: list[Body] = []
        for each in kept.bodies:
            if each.part.name == name:
                each = Body(each.part, where, STILL, HELD)
            elif each.on == name:
                each = Body(each.part, each.pose, each.velocity, FALLS)
            bodies.append(each)
        handling.restore(HandlingState(0.02, Parts(tuple(bodies), in_tcp, met=kept.met)), tcp)
        self.books.brings()
        self.step(ticks)

    def _may_push(self, name: str, brought: Transform, tcp: Transform) -> bool:
        """Whether a part that jaws have, and bring between them, may be in another on that way, or one may
        fall into it: by the balls round both."""
        pieces = self.books.pieces
        bodies, fall = pieces.bodies, {each.part.name for each in pieces.riders(name)}
        x, y, z = brought.translation
        low, high = sorted((y, tcp.translation[1]))
        for each in bodies.values():
            u, v, w = each.pose.translation
            stays = each.state == LIES and each.part.name not in fall
            away = hypot(x - u, min(max(v, low), high) - v, z - w if stays else 0.0)
            near = away < each.part.shape.extent + bodies[name].part.shape.extent
            if near and each.state in (LIES, FALLS) and each.part.name != name:
                return True
        return False

    def _restores(self) -> None:
        states = States(self.scene.controller)
        states.save("then")
        self.step(int(self._rng.integers(1, 100)))
        states.restore("then")
        self.books.brings()

    def goes_through(self) -> None:
        """Jaws, open or closed, go along y, through all of it, until all rests."""
        self.pushes(600.0 + float(self._rng.uniform(-40.0, 40.0)))
        self.rests()

    def pushes(self, x_mm: float, highest_mm: float = 60.0) -> None:
        """Jaws, open or closed and without a part, go along y, so far along x."""
        if self.books.pieces.held:
            self.scene.handling.lose()
        self.scene.controller.io.set_output(CLOSE, bool(self._rng.random() < 0.5))
        self.goes_along(x_mm, TABLE_MM + float(self._rng.uniform(8.0, highest_mm)))

    def goes_along(self, x_mm: float, z_mm: float) -> None:
        """The TCP goes along y, so far along x, and at this height."""
        controller = self.scene.controller
        speed = float(self._rng.choice([0.05, 0.1, 0.2, 0.3]))
        for y_mm, high_mm, fast in ((BEGIN_MM, ABOVE_MM, 0.5), (BEGIN_MM, z_mm, 0.5), (150.0, z_mm, speed)):
            with suppress(Refused):  # it may have protected itself
                controller.move(lin_move(down(x_mm, y_mm, high_mm), fast, 0.0))
            while controller.moving:
                self.step()

    def goes_down(self, x_mm: float, y_mm: float, z_mm: float, deep_mm: float) -> None:
        """The TCP goes down there to so far below a height, along by up to 30 mm, and up again."""
        controller, rng = self.scene.controller, self._rng
        dx, dy = rng.uniform(-30.0, 30.0, 2).tolist()
        speed = float(rng.choice([0.01, 0.05, 0.2]))
        for x, y, z, fast in (
            (x_mm, y_mm, ABOVE_MM, 0.5),
            (x_mm, y_mm, z_mm - deep_mm, speed),
            (x_mm + dx, y_mm + dy, z_mm - deep_mm, speed),
            (x_mm + dx, y_mm + dy, z_mm + 30.0, speed),
        ):
            with suppress(Refused):  # it may have protected itself
                controller.move(lin_move(down(x, y, z), fast, 0.0))
            while controller.moving:
                self.step()


def _goes_on(body: Body) -> bool:
    """Whether nothing brakes a part: it rubs not at all, or is a ball that turns on its spot."""
    on_its_spot = isinstance(body.part.shape, Sphere) and hypot(*body.velocity) < SLOW_M_PER_S
    return body.part.friction == 0.0 or on_its_spot
