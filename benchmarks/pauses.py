"""How long a change of the override takes on a normal move: to a pause, and back to full rate.

The slowest joint bounds that: with its limits of acceleration and jerk it cannot lose its speed sooner,
however the rate is changed.
"""

from statistics import median
from typing import NamedTuple

import numpy as np
from ruckig import ControlInterface, InputParameter, Ruckig, Trajectory

from benchmarks.figures import Figure, percentile
from benchmarks.lines import random_joints
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import RobotDescription, load_robot
from tests.asked import joint_move, lin_move, ptp_move

ROBOTS = ("lbr_iiwa_7_r800", "kr_6_r900_sixx")
TICK_S = 0.002
PROGRAMS = 80
CHANGES = 4
"""At most, in each of them."""
MOVES = 5
GOAL_S = 0.3
LONGEST_S = 5.0


class Change(NamedTuple):
    """A change from a rate to another one (s)."""

    took_s: float
    alone_s: float
    """What the slowest joint needs alone."""


def measure() -> list[Figure]:
    """Measure random programs of lines, PTP and joint moves with corners, on both arms."""
    figures = []
    for name in ROBOTS:
        pauses, returns = changes(load_robot(name))
        for what, found in (("to a pause", pauses), ("back", returns)):
            took = [each.took_s for each in found]
            over = [each.took_s - each.alone_s for each in found]
            of = f"override of {name}, {what}"
            late = sum(each > GOAL_S for each in took)
            unneeded = sum(each.took_s > GOAL_S >= each.alone_s for each in found)
            figures += [
                Figure(f"{of}, median of {len(took)}", median(took), "s"),
                Figure(f"{of}, p90", percentile(took, 0.9), "s"),
                Figure(f"{of}, largest", max(took), "s"),
                Figure(f"{of}, over what the slowest joint needs alone, median", median(over), "s"),
                Figure(f"{of}, over that, p90", percentile(over, 0.9), "s"),
                Figure(f"{of}, over that, largest", max(over), "s"),
                Figure(f"{of}, longer than {GOAL_S} s", late, ""),
                Figure(f"{of}, longer where no joint needs so long", unneeded, ""),
            ]
    return figures


def changes(description: RobotDescription) -> tuple[list[Change], list[Change]]:
    """Changes to a pause, and back from there."""
    pauses: list[Change] = []
    returns: list[Change] = []
    for seed in range(PROGRAMS):
        rng = np.random.default_rng(seed)
        controller = sent(description, rng)
        for _ in range(CHANGES):
            for _ in range(int(rng.uniform(0.05, 0.8) / TICK_S)):
                controller.step()
            if not controller.moving:
                break
            pauses.append(change(controller, 0.0, description))
            back = change(controller, 1.0, description)
            if controller.moving:  # else it has ended sooner
                returns.append(back)
    return pauses, returns


def sent(description: RobotDescription, rng: np.random.Generator) -> Controller:
    """A robot with moves that wait: lines, PTP and joint moves, at full speed, with corners of all sizes."""
    controller = Controller(description, TICK_S)
    accepted = 0
    while accepted < MOVES:
        end = np.array(controller.end_of_queue)
        frame = np.array(controller.tcp_frame_at(tuple(end.tolist())))
        frame += np.concatenate([rng.uniform(-250.0, 250.0, 3), rng.uniform(-0.5, 0.5, 3)])
        radius_mm = float(rng.choice([0.0, 5.0, 20.0, 60.0]))
        requests = (
            joint_move(random_joints(description, rng), [1.0] * len(end)),
            ptp_move(Frame(*frame.tolist()), 1.0, radius_mm),
            lin_move(Frame(*frame.tolist()), 1.0, radius_mm),
        )
        try:
            controller.move(requests[int(rng.integers(len(requests)))])
        except Refused:
            continue
        accepted += 1
    return controller


def change(controller: Controller, value: float, description: RobotDescription) -> Change:
    """Set the override, and wait until its rate is there."""
    override = controller._core.motions._override
    pauses, ticks = value == 0.0, 0
    state = planned(controller)
    controller.set_override(value)
    while override.changing and controller.moving:
        controller.step()
        ticks += 1
        if ticks * TICK_S > LONGEST_S:
            raise RuntimeError(f"the override is not {value} after {LONGEST_S} s")
    if not pauses and controller.moving:
        state = planned(controller)
    return Change(ticks * TICK_S, alone_s(*state, description))


def planned(controller: Controller) -> tuple[list[float], list[float]]:
    """Velocities (rad/s) and accelerations (rad/s^2) of the plan where it is."""
    drive = controller._core.motions.drive
    running = drive.running
    if running is None:
        return [0.0] * len(controller.joints), [0.0] * len(controller.joints)
    derivatives, _ = running.plan.along(np.array([running.time_s]))
    return derivatives[0, 1].tolist(), derivatives[0, 2].tolist()


def alone_s(velocity: list[float], acceleration: list[float], d: RobotDescription) -> float:
    """How long the slowest joint needs at the least from there to rest, within its limits: as long as from
    rest to there, which is the same way backwards."""
    longest = 0.0
    for v, a, most, jerk in zip(velocity, acceleration, d.acceleration, d.jerk, strict=True):
        task = InputParameter(1)
        task.control_interface = ControlInterface.Velocity
        task.current_velocity, task.current_acceleration = [v], [a]
        task.max_acceleration, task.max_jerk = [max(most, abs(a))], [jerk]
        way = Trajectory(1)
        Ruckig(1).calculate(task, way)
        longest = max(longest, way.duration)
    return longest
