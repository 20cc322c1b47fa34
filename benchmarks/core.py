"""Speed of simulated time: the controller stepped in a loop, without clock or sockets."""

import gc
import random
from collections.abc import Callable, Sequence
from statistics import median
from time import thread_time

from benchmarks.figures import Figure, Kind
from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.joint_trajectories import TrajectoryRequest
from iiwa_sim.controller.requests import JOINT_BLENDING, MoveRequest, TcpCompliance
from iiwa_sim.controller.requests import Kind as How
from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.motion.joint_trajectory import Knot
from iiwa_sim.robot.description import load_robot

SEED = 3
TICK_S = 0.002
BLOCKS = 20
TICKS_PER_BLOCK = 20_000
HOLD_TICKS = 500  # with a constant push
STIFFNESS_N_PER_M = 2000.0
STIFFNESS_NM_PER_RAD = 300.0
WEIGHED_DOWN_N = (0.0, 0.0, -10.0, 0.0, 0.0, 0.0)  # compensated, so that the TCP presses with 10 N
POINTS, POINT_S = 25, 0.4  # of a joint trajectory of straight lines, which have to be smoothed
RADIUS_M = 0.005  # radius of the sphere that touches the table, which its centre then does


def _joint_move(joints: Sequence[float], speed_rel: float) -> MoveRequest:
    return MoveRequest(How.PTP, joints, speeds=[speed_rel] * 7, blending=JOINT_BLENDING)


def measure() -> list[Figure]:
    """Measure; planning is counted apart from stepping, as it happens between ticks."""
    chance = random.Random(SEED)
    description = load_robot("lbr_iiwa_7_r800")
    robot = Controller(description, tick_s=TICK_S)
    home = robot.joints
    centre = robot.tool_frame()
    top = Transform(IDENTITY.rotation, (0.0, 0.0, 1e-3 * centre.z_mm))
    table = Surface("table", Plane(), top, 20e3, 0.5, 0.3)
    following = Controller(description, tick_s=TICK_S)
    pressing, yielding, held = (
        Controller(description, tick_s=TICK_S, world=TcpContact([table], RADIUS_M)) for _ in range(3)
    )

    def joint() -> None:
        robot.move(_joint_move([q + chance.uniform(-0.4, 0.4) for q in home], 0.5))

    def lin() -> None:
        x_mm = centre.x_mm + chance.uniform(-150, 50)
        y_mm = centre.y_mm + chance.uniform(-200, 200)
        z_mm = centre.z_mm + chance.uniform(-150, 50)
        robot.move(MoveRequest(How.LIN, centre._replace(x_mm=x_mm, y_mm=y_mm, z_mm=z_mm), 0.5))

    def slide() -> None:
        x_mm = centre.x_mm + chance.uniform(-150, 50)
        y_mm = centre.y_mm + chance.uniform(-200, 200)
        pressing.move(MoveRequest(How.LIN, centre._replace(x_mm=x_mm, y_mm=y_mm), 0.5))

    def slide_softly() -> None:
        x_mm = centre.x_mm + chance.uniform(-150, 50)
        y_mm = centre.y_mm + chance.uniform(-200, 200)
        target = centre._replace(x_mm=x_mm, y_mm=y_mm)
        compliance = TcpCompliance(STIFFNESS_N_PER_M, WEIGHED_DOWN_N)
        yielding.move(MoveRequest(How.LIN, target, 0.5, compliance=compliance))

    def hold() -> None:
        """Hold the joints against a changing push, down and to the sides."""
        if not held.moving:
            held.move(MoveRequest(How.HOLD, hold_nm_per_rad=STIFFNESS_NM_PER_RAD))
        sideways_n, down_n = chance.uniform(-5, 5), chance.uniform(10, 30)
        held.load.wrench = (0.0, sideways_n, down_n, 0.0, 0.0, 0.0)  # the TCP's z axis points down

    def follow() -> None:
        """Follow points told without velocities."""
        places = [[q + chance.uniform(-0.15, 0.15) for q in home] for _ in range(POINTS - 1)]
        points = [Knot(POINT_S * k, place) for k, place in enumerate([*places, home], start=1)]
        following.trajectories.follow(TrajectoryRequest(description.joints, points))

    def back_home() -> None:
        robot.stop()
        robot.move(_joint_move(home, 1.0))
        while robot.moving:
            robot.step()

    rates: dict[str, list[float]] = {"joint moves": [], "LIN moves": []}
    for _ in range(BLOCKS // 2):
        for name, command in (("joint moves", joint), ("LIN moves", lin)):
            rates[name].append(_rate(robot, command))
            back_home()
    goals = {"joint moves": 480, "LIN moves": 280}
    others = [
        ("LIN moves pressed on a table", pressing, slide, TICKS_PER_BLOCK, 200),
        ("stiffness moves pressed on a table", yielding, slide_softly, TICKS_PER_BLOCK, 110),
        ("gravity hold pressed on a table", held, hold, HOLD_TICKS, 170),
        ("joint trajectory, smoothed", following, follow, TICKS_PER_BLOCK, 200),
    ]
    return [
        *(
            Figure(
                f"stepped core, {name}",
                median(found),
                "x real time",
                at_least=goals[name],
                kind=Kind.CPU,
            )
            for name, found in rates.items()
        ),
        *(
            Figure(
                f"stepped core, {name}",
                median(_rate(controller, command, at_once) for _ in range(BLOCKS // 2)),
                "x real time",
                at_least=goal,
                kind=Kind.CPU,
            )
            for name, controller, command, at_once, goal in others
        ),
    ]


def _rate(robot: Controller, command: Callable[[], None], ticks_at_once: int = TICKS_PER_BLOCK) -> float:
    """Simulated seconds per second of computing, while in motion.

    A command is sent when the robot has stopped, or after `ticks_at_once` ticks.
    """
    spent = 0.0
    ticks = 0
    gc.disable()
    try:
        while ticks < TICKS_PER_BLOCK:
            command()
            first = robot.tick
            start = thread_time()
            while robot.moving and robot.tick - first < ticks_at_once:
                robot.step()
            spent += thread_time() - start
            ticks += robot.tick - first
    finally:
        gc.enable()
    return ticks * robot.tick_s / spent
