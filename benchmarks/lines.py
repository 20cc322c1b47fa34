"""Random moves, planned for one robot, for comparing durations with the time-optimum."""

from collections.abc import Iterator

import numpy as np

from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.planner import Planner
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.trajectory import Trajectory, at_once, begun, planned_on
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

SHARE_OF_LIMITS = 0.8  # part of the joint range from which lines start
LENGTHS_MM = (200.0, 600.0)
LARGEST_TURN_RAD = 1.0
UNDER_WAY_S = 0.01  # planning of a long line first gives a quick result, then a better one


def random_lines(
    description: RobotDescription, count: int, seed: int, speed_rel: float = 1.0
) -> Iterator[Move]:
    """Random LIN of 200 to 600 mm in any direction, turning by up to 1 rad, anywhere the robot can do
    them."""
    rng = np.random.default_rng(seed)
    model = Model(description)
    planner = Planner(model)
    tcp = model.tcp(description.tool_in_flange)
    while count:
        start = random_joints(description, rng)
        frame = Frame.from_transform(tcp.pose(start))
        way = rng.normal(size=3)
        way *= rng.uniform(*LENGTHS_MM) / np.linalg.norm(way)
        turn = rng.normal(size=3)
        turn *= rng.uniform(0.0, LARGEST_TURN_RAD) / np.linalg.norm(turn)
        target = Frame(*np.add(frame, (*way, *turn)).tolist())
        try:
            yield planner.plan(MoveRequest(Kind.LIN, target, speed_rel), start, tcp)
        except Refused:
            continue
        count -= 1


def trajectory_of(move: Move) -> Trajectory:
    """Return the trajectory of one move."""
    found = begun(move)
    if not found.rough:
        return found
    return at_once(planned_on(found, 0.0, UNDER_WAY_S, [], [])) or found


def random_joints(description: RobotDescription, rng: np.random.Generator) -> tuple[float, ...]:
    """Random joint positions (rad) within the limits."""
    lower, upper = np.array(description.position_min), np.array(description.position_max)
    return tuple((SHARE_OF_LIMITS * rng.uniform(lower, upper)).tolist())
