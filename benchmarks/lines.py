"""Random moves, as they are planned for one robot: what durations and their time-optimum are compared on."""

from collections.abc import Iterator

import numpy as np

from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.planner import Plan, Planner
from iiwa_sim.controller.requests import JOINT_BLENDING
from iiwa_sim.frames import Frame, compose
from iiwa_sim.motion.queue.chain import Chain
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.planning import begun, planned_on
from iiwa_sim.motion.slices import at_once
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

SHARE_OF_LIMITS = 0.8  # the joint positions that lines start from lie within this share
LENGTHS_MM = (200.0, 600.0)
LARGEST_TURN_RAD = 1.0
UNDER_WAY_S = 0.01  # a chain is planned quickly to set out with, and better when it has


def random_lines(
    description: RobotDescription, count: int, seed: int, speed_rel: float = 1.0
) -> Iterator[Plan]:
    """LIN moves of 200 to 600 mm in any direction, turning by up to 1 rad, anywhere the robot can do them."""
    rng = np.random.default_rng(seed)
    model = Model(description)
    planner = Planner(model)
    tool = description.tool_in_flange
    while count:
        start = random_joints(description, rng)
        frame = Frame.from_transform(compose(model.flange(start), tool))
        way = rng.normal(size=3)
        way *= rng.uniform(*LENGTHS_MM) / np.linalg.norm(way)
        turn = rng.normal(size=3)
        turn *= rng.uniform(0.0, LARGEST_TURN_RAD) / np.linalg.norm(turn)
        target = Frame(*np.add(frame, (*way, *turn)).tolist())
        try:
            yield planner.lin(start, target, speed_rel, 0.0, None, tool)
        except Refused:
            continue
        count -= 1


def random_joint_lines(description: RobotDescription, count: int, seed: int) -> Iterator[Plan]:
    """PTP moves between any two joint positions."""
    rng = np.random.default_rng(seed)
    planner = Planner(Model(description))
    for _ in range(count):
        start, end = random_joints(description, rng), random_joints(description, rng)
        yield planner.joint_line(start, end, [1.0] * len(end), JOINT_BLENDING)


def chain_of(plan: Plan) -> Chain:
    """The move alone, with its timing."""
    chain = begun(Move(1, *plan, lambda _: None))
    return at_once(planned_on(chain, 0.0, UNDER_WAY_S, [], [])) or chain


def random_joints(description: RobotDescription, rng: np.random.Generator) -> tuple[float, ...]:
    """Joint positions (rad) somewhere within the limits."""
    lower, upper = np.array(description.position_min), np.array(description.position_max)
    return tuple((SHARE_OF_LIMITS * rng.uniform(lower, upper)).tolist())
