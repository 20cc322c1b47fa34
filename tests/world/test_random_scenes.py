"""Random scenes of falling, piling, gripping and ploughing: parts come to rest with bounded speeds."""

from __future__ import annotations

from contextlib import suppress
from math import sqrt

import numpy as np
import pytest

from iiwa_sim.cell.settings import CellFault
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from tests.requests import lin_move_at, ptp_move
from tests.world.scenes import CLOSE, GRIPPER, HEAD, Scene, down, part, table

FASTEST_M_S = 10.0
DEEPEST_M = 0.005
AWAY = (HEAD + GRIPPER).replace("[0, 30,", "[90, 30,")
FLOOR = '[[plane]]\nname = "floor"\nz_mm = 0\nstiffness_n_per_m = 100000\nfriction = 0.4\n'


class RandomScene:
    """Up to a dozen parts above a table with a ramp and a wall, and an arm that reaches among them."""

    def __init__(self, seed: int) -> None:
        rng = self._rng = np.random.default_rng(seed)
        stiffness = float(10.0 ** rng.uniform(4.0, 6.0))
        texts = [table(stiffness, float(rng.uniform(0.1, 0.8))), FLOOR]
        if rng.random() < 0.5:
            turned = float(rng.uniform(-0.5, 0.5))
            texts.append(
                table(stiffness, 0.4, name="ramp").replace("[800, 1200, 40]", "[300, 300, 40]")
                + f"beta = {turned}\ny_mm = 300\n"
            )
        if rng.random() < 0.5:
            texts.append(
                table(stiffness, 0.4, name="wall")
                .replace("[800, 1200, 40]", "[300, 20, 200]")
                .replace("280", "390")
                + "y_mm = -220\n"
            )
        count = int(rng.integers(1, 13))
        texts += [self._part(number) for number in range(count)]
        try:
            self.scene = Scene(*texts, head=AWAY)
        except CellFault:  # a part would begin inside the wall
            self.scene = Scene(*(each for each in texts if 'name = "wall"' not in each), head=AWAY)
        self.fastest = self.pressed_n = 0.0

    def _part(self, number: int) -> str:
        rng = self._rng
        a, b, c = (rng.uniform(12.0, 70.0, 3)).tolist()
        size = (f"[{0.5 * a}]", f"[{0.5 * a}, {b}]", f"[{a}, {b}, {c}]")[rng.integers(3)]
        kg = max(0.002, 1e-9 * a * b * c * float(10.0 ** rng.uniform(2.3, 3.7)))
        x, y = rng.uniform(350.0, 650.0), rng.uniform(-180.0, 180.0)
        z = 480.0 + 130.0 * number
        turned = rng.normal(size=3) * rng.choice([0.0, 1.0])
        more = "alpha = {}\nbeta = {}\ngamma = {}\n".format(*turned.tolist())
        stiffness = float(10.0 ** rng.uniform(4.0, 6.0))
        return part(f"{number}", (x, y, z), size, kg, float(rng.uniform(0.1, 1.0)), stiffness, more)

    def run(self) -> None:
        rng, scene = self._rng, self.scene
        self._steps(int(rng.integers(0, 600)))
        for _ in range(int(rng.integers(1, 5))):
            names = [each for each in scene.handling.parts if each.state != "gone"]
            x, y, z = names[int(rng.integers(len(names)))].frame[:3] if names else (500.0, 0.0, 330.0)
            x, y = min(max(x, 350.0), 650.0), min(max(y, -300.0), 300.0)
            z = min(max(z, 312.0), 500.0)
            turned = Frame(x, y, z + 100.0, 3.14159 + float(rng.uniform(-0.7, 0.7)), 0.0, 3.14159)
            self._moves(ptp_move(turned, 1.0, 0.0))
            deep = turned._replace(z_mm=z + float(rng.uniform(-2.0, 10.0)))
            self._moves(lin_move_at(deep, 0.25, 0.0))
            if rng.random() < 0.7:
                scene.controller.io.set_output(CLOSE, True)
                self._steps(300)
                self._moves(lin_move_at(turned, float(rng.uniform(0.05, 0.25)), 0.0))
                self._moves(ptp_move(turned._replace(y_mm=float(rng.uniform(-150.0, 150.0))), 1.0, 0.0))
            else:
                aside = down(x, float(rng.uniform(-200.0, 200.0)), deep.z_mm)
                self._moves(lin_move_at(aside, float(rng.uniform(0.05, 0.25)), 0.0))
            scene.controller.io.set_output(CLOSE, bool(rng.random() < 0.3))
            self._steps(int(rng.integers(0, 300)))
        scene.controller.io.set_output(CLOSE, False)
        tcp = scene.controller.tool_frame()
        self._moves(lin_move_at(tcp._replace(z_mm=tcp.z_mm + 150.0), 0.25, 0.0))
        ticks = 0
        while not scene.handling.settled:
            self._steps(10)
            ticks += 10
            assert ticks < 50_000, "it does not come to rest"

    def _moves(self, request: object) -> None:
        controller = self.scene.controller
        with suppress(Refused):
            controller.errors.reset()
            controller.move(request)  # type: ignore[arg-type]
            while controller.moving:
                self._steps(1)

    def _steps(self, ticks: int) -> None:
        scene = self.scene
        for _ in range(ticks):
            scene.step()
            if scene.world.quiet or scene.world._frozen:
                continue
            world = scene.world
            assert np.isfinite(world.data.qpos).all()
            assert np.isfinite(world.data.qvel).all()
            self.pressed_n = max(self.pressed_n, float(np.linalg.norm(scene.force[:3])))
            for number, each in enumerate(world.parts):
                if number in world._gone:
                    continue
                speed = float(np.linalg.norm(world.part_v[number, :3]))
                self.fastest = max(self.fastest, speed)
                # What the arm squeezes out leaves with the energy of its spring.
                assert speed < FASTEST_M_S + self.pressed_n / sqrt(each.mass_kg * each.stiffness), each.name
                place = world.part_q[number, :3].tolist()
                for surface in world.surfaces:
                    # Its kinetic energy, in the springs of both, and half of its distance in a tick.
                    soft = each.mass_kg * (1.0 / each.stiffness + 1.0 / surface.stiffness)
                    deepest = DEEPEST_M + self.fastest * sqrt(soft) + 0.5 * speed * scene.controller.tick_s
                    deepest += self.pressed_n / surface.stiffness  # between the arm and the surface
                    assert surface.nearest(*place)[0] > -deepest, (each.name, surface.name)


def test_nothing_explodes_and_all_comes_to_rest() -> None:
    RandomScene(34).run()


@pytest.mark.slow
@pytest.mark.parametrize("hundred", range(10))
def test_a_thousand_scenes(hundred: int) -> None:
    for seed in range(100 * hundred, 100 * hundred + 100):
        RandomScene(seed).run()
