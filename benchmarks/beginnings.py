"""Latency in ticks: from an accepted move to the first motion, from rest, and from a stop command to
braking."""

from collections.abc import Callable, Sequence

from benchmarks.figures import Figure, Kind
from iiwa_sim.controller.controller import Controller
from iiwa_sim.robot.description import load_robot
from tests import asked

ROBOTS = ("lbr_iiwa_7_r800", "kr_6_r900_sixx")
TICK_S = 0.002
WAY_RAD, WAY_MM = 0.05, 30.0
SPEED_REL = 0.3
NO_FORCE = [0.0] * 6
ON_THE_WAY = 40
MOST = 1000


def measure() -> list[Figure]:
    """The largest latency of two robots for each kind of move. The same in each run."""
    return [
        *(
            Figure(
                f"{kind}, from accepted to the first motion",
                max(_ticks_to_begin(name, begin) for name in ROBOTS),
                "ticks",
                at_most=1.0,
                kind=Kind.SIMULATED,
            )
            for kind, begin in MOVES.items()
        ),
        Figure(
            "stop, from accepted to slower than without",
            max(_ticks_to_brake(name) for name in ROBOTS),
            "ticks",
            at_most=1.0,
            kind=Kind.SIMULATED,
        ),
    ]


def _joints(robot: Controller) -> Sequence[float]:
    return [q + WAY_RAD for q in robot.joints]


def _speeds(robot: Controller) -> Sequence[float]:
    return [SPEED_REL] * len(robot.joints)


def _lin(robot: Controller) -> None:
    frame = robot.tool_frame()
    robot.move(asked.lin_move(frame._replace(z_mm=frame.z_mm - WAY_MM), SPEED_REL, 0.0))


def _ptp(robot: Controller) -> None:
    frame = robot.tool_frame()
    robot.move(asked.ptp_move(frame._replace(z_mm=frame.z_mm - WAY_MM), SPEED_REL, 0.0))


def _lin_stiff(robot: Controller) -> None:
    frame = robot.tool_frame()
    robot.move(asked.lin_stiff_move(frame._replace(z_mm=frame.z_mm - WAY_MM), SPEED_REL, 2000.0, NO_FORCE))


MOVES: dict[str, Callable[[Controller], object]] = {
    "joint move": lambda robot: robot.move(asked.joint_move(_joints(robot), _speeds(robot))),
    "ptp move": _ptp,
    "lin move": _lin,
    "linstiff move": _lin_stiff,
    "smart joint move": lambda robot: robot.move(asked.smart_joint_move(_joints(robot), _speeds(robot))),
    "direct joint move": lambda robot: robot.move(asked.direct_joint_move(_joints(robot), _speeds(robot))),
}


def _ticks_to_begin(name: str, begin: Callable[[Controller], object]) -> float:
    robot = Controller(load_robot(name), TICK_S)
    at_rest = robot.joints
    begin(robot)
    for tick in range(1, MOST):
        robot.step()
        if robot.joints != at_rest:
            return tick
    raise RuntimeError(f"{name} should have moved within {MOST} ticks")


def _ticks_to_brake(name: str) -> float:
    """Ticks until a stopped robot falls behind one that goes on."""
    stopped, on = (Controller(load_robot(name), TICK_S) for _ in range(2))
    for robot in (stopped, on):
        MOVES["lin move"](robot)
        for _ in range(ON_THE_WAY):
            robot.step()
    stopped.stop()
    for tick in range(1, MOST):
        stopped.step()
        on.step()
        if stopped.joints != on.joints:
            return tick
    raise RuntimeError(f"{name} should have braked within {MOST} ticks")
