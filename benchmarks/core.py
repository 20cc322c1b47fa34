"""Speed of simulated time: the controller stepped in a loop, without clock or sockets."""

import gc
import random
from collections.abc import Callable
from statistics import median
from time import thread_time

from benchmarks.figure import Figure
from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.joint_trajectories import TrajectoryRequest
from iiwa_sim.controller.requests import JOINT_BLENDING, Kind, MoveRequest
from iiwa_sim.frames import IDENTITY, Frame, Transform
from iiwa_sim.motion.joint_trajectory import Knot
from iiwa_sim.motion.springs import CartesianImpedance
from iiwa_sim.robot.description import load_robot

TICK_S = 0.002
BLOCKS, TICKS_PER_BLOCK = 10, 20_000
COMPLIANCE = CartesianImpedance(2000.0, (0.0, 0.0, 10.0, 0.0, 0.0, 0.0))  # presses with 10 N
HOLD_TICKS = 500  # with a constant push
POINTS, POINT_S = 25, 0.4  # of a joint trajectory of straight lines, which have to be smoothed
RADIUS_M = 0.005  # radius of the sphere that touches the table, which its centre then does


class Scenario:
    """A robot, alone or above a table that its TCP touches, and random commands for it."""

    def __init__(self, table: bool = False) -> None:
        self.random = random.Random(3)
        self.description = load_robot("lbr_iiwa_7_r800")
        centre = Controller(self.description, TICK_S).tool_frame()
        top = Transform(IDENTITY.rotation, (0.0, 0.0, 1e-3 * centre.z_mm))
        contact = TcpContact([Surface("table", Plane(), top, 20e3, 0.5, 0.3)], RADIUS_M)
        self.robot = Controller(self.description, TICK_S, **({"contact": contact} if table else {}))
        self.home, self.centre = self.robot.joints, centre

    def joints(self, most: float) -> list[float]:
        return [q + self.random.uniform(-most, most) for q in self.home]

    def frame(self, lower_mm: float = 0.0, upper_mm: float = 0.0) -> Frame:
        x, y = self.random.uniform(-150, 50), self.random.uniform(-200, 200)
        z = self.random.uniform(lower_mm, upper_mm)
        c = self.centre
        return c._replace(x_mm=c.x_mm + x, y_mm=c.y_mm + y, z_mm=c.z_mm + z)

    def joint(self) -> None:
        self.robot.move(MoveRequest(Kind.PTP, self.joints(0.4), speeds=[0.5] * 7, blending=JOINT_BLENDING))

    def lin(self) -> None:
        self.robot.move(MoveRequest(Kind.LIN, self.frame(-150, 50), 0.5))

    def slide(self) -> None:
        self.robot.move(MoveRequest(Kind.LIN, self.frame(), 0.5))

    def slide_softly(self) -> None:
        self.robot.move(MoveRequest(Kind.LIN, self.frame(), 0.5, compliance=COMPLIANCE))

    def hold(self) -> None:
        """Hold the joints against a changing push, down and to the sides."""
        if not self.robot.moving:
            self.robot.move(MoveRequest(Kind.HOLD, hold_nm_per_rad=300.0))
        sideways_n, down_n = self.random.uniform(-5, 5), self.random.uniform(10, 30)
        self.robot.load.wrench = (0.0, sideways_n, down_n, 0.0, 0.0, 0.0)  # the TCP's z axis points down

    def follow(self) -> None:
        """Follow points without velocities."""
        places = [*(self.joints(0.15) for _ in range(POINTS - 1)), self.home]
        points = [Knot(POINT_S * k, place) for k, place in enumerate(places, start=1)]
        self.robot.trajectories.follow(TrajectoryRequest(self.description.joints, points))

    def rate(self, command: "Callable[[Scenario], None]", ticks_at_once: int) -> float:
        """Simulated seconds per second of computing, while in motion and without planning.

        A command is sent when the robot has stopped, or after `ticks_at_once` ticks.
        """
        robot, spent, ticks = self.robot, 0.0, 0
        gc.disable()
        try:
            while ticks < TICKS_PER_BLOCK:
                command(self)
                first, start = robot.tick, thread_time()
                while robot.moving and robot.tick - first < ticks_at_once:
                    robot.step()
                spent += thread_time() - start
                ticks += robot.tick - first
        finally:
            gc.enable()
        return ticks * robot.tick_s / spent


def measure() -> list[Figure]:
    """Measure; planning does not count, as it happens between ticks."""
    figures = []
    for name, command, table, ticks_at_once, goal in (
        ("joint moves", Scenario.joint, False, TICKS_PER_BLOCK, 480),
        ("LIN moves", Scenario.lin, False, TICKS_PER_BLOCK, 280),
        ("LIN moves pressed on a table", Scenario.slide, True, TICKS_PER_BLOCK, 200),
        ("stiffness moves pressed on a table", Scenario.slide_softly, True, TICKS_PER_BLOCK, 110),
        ("gravity hold pressed on a table", Scenario.hold, True, HOLD_TICKS, 170),
        ("joint trajectory, smoothed", Scenario.follow, False, TICKS_PER_BLOCK, 200),
    ):
        scenario = Scenario(table)
        rates = [scenario.rate(command, ticks_at_once) for _ in range(BLOCKS)]
        figures.append(
            Figure(f"stepped core, {name}", median(rates), "x real time", at_least=goal, margin=2.0)
        )
    return figures
