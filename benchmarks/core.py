"""How fast simulated time can run: the controller stepped in a loop, without clock or sockets."""

import gc
import random
from collections.abc import Callable
from statistics import median
from time import thread_time

from benchmarks.figures import Figure
from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.world import World
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.robot.description import load_robot

SEED = 3
TICK_S = 0.002
BLOCKS = 20
TICKS_PER_BLOCK = 20_000
RADIUS_M = 0.005  # of the sphere that touches the table, which its middle then does


def measure() -> list[Figure]:
    """Planning is counted apart from stepping: it happens between ticks."""
    chance = random.Random(SEED)
    description = load_robot("lbr_iiwa_7_r800")
    robot = Controller(description, tick_s=TICK_S)
    home = robot.joints
    centre = robot.tool_frame()
    top = Transform(IDENTITY.rotation, (0.0, 0.0, 1e-3 * centre.z_mm))
    table = World([Surface("table", Plane(), top, 20e3, 0.5, 0.3)], RADIUS_M)
    pressing = Controller(description, tick_s=TICK_S, world=table)

    def joint() -> None:
        robot.joint_move([q + chance.uniform(-0.4, 0.4) for q in home], [0.5] * 7)

    def lin() -> None:
        x_mm = centre.x_mm + chance.uniform(-150, 50)
        y_mm = centre.y_mm + chance.uniform(-200, 200)
        z_mm = centre.z_mm + chance.uniform(-150, 50)
        robot.lin_move(centre._replace(x_mm=x_mm, y_mm=y_mm, z_mm=z_mm), 0.5, 0.0)

    def slide() -> None:
        x_mm = centre.x_mm + chance.uniform(-150, 50)
        y_mm = centre.y_mm + chance.uniform(-200, 200)
        pressing.lin_move(centre._replace(x_mm=x_mm, y_mm=y_mm), 0.5, 0.0)

    def back_home() -> None:
        robot.stop()
        robot.joint_move(home, [1.0] * 7)
        while robot.moving:
            robot.step()

    rates: dict[str, list[float]] = {"joint moves": [], "LIN moves": []}
    for _ in range(BLOCKS // 2):
        for name, command in (("joint moves", joint), ("LIN moves", lin)):
            rates[name].append(_rate(robot, command))
            back_home()
    slides = median(_rate(pressing, slide) for _ in range(BLOCKS // 2))
    return [
        *(
            Figure(f"stepped core, {name}", median(found), "x real time", at_least=200)
            for name, found in rates.items()
        ),
        Figure("stepped core, LIN moves pressed on a table", slides, "x real time", at_least=100),
    ]


def _rate(robot: Controller, command: Callable[[], None]) -> float:
    """Simulated seconds per second of computing, every tick of it in motion."""
    spent = 0.0
    ticks = 0
    gc.disable()
    try:
        while ticks < TICKS_PER_BLOCK:
            command()
            first = robot.tick
            start = thread_time()
            while robot.moving:
                robot.step()
            spent += thread_time() - start
            ticks += robot.tick - first
    finally:
        gc.enable()
    return ticks * robot.tick_s / spent
