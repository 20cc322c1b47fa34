"""Cost of a new servo target, and the lag of a robot behind a stream of targets on a circle of the flange."""

from math import cos, sin
from time import perf_counter

import numpy as np

from benchmarks.figures import Figure, percentile
from iiwa_sim.frames import Frame
from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.servo import Servo
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.nearest import Nearest

TICK_S = 0.002
RADIUS_MM = 100.0
SPEED_M_PER_S = 0.3
SECONDS = 10.0
JITTER = 0.4  # part of the period, to both sides
SEED = 4


def measure() -> list[Figure]:
    """Measure the default robot, with jittered targets: smart at 50 Hz, direct at 100 Hz."""
    robot = load_robot()
    velocity = np.array(robot.velocity)
    smart = JointLimits(velocity, np.array(robot.acceleration), np.array(robot.jerk))
    direct = JointLimits(velocity, np.array(robot.direct_acceleration), np.array(robot.direct_jerk))
    figures = []
    for name, limits, rate_hz in (("smart", smart, 50), ("direct", direct, 100)):
        lag_s, solving_us, heading_us = _circle(robot, limits, 1.0 / rate_hz)
        figures.append(Figure(f"lag of a {name} stream, {rate_hz} Hz, 0.3 m/s", 1e3 * lag_s, "ms"))
        for what, taken in (("heading for a target", heading_us), ("solving its frame", solving_us)):
            figures += [
                Figure(f"{name}, {what}, {share}", percentile(taken, part), "us")
                for share, part in (("p50", 0.5), ("p95", 0.95))
            ]
    return figures


def _circle(
    robot: RobotDescription, limits: JointLimits, period_s: float
) -> tuple[float, list[float], list[float]]:
    """The time shift at which joints and targets fit best (s), and the cost of each command (us)."""
    chance = np.random.default_rng(SEED)
    model = Model(robot)
    nearest = Nearest(Inverse(model), robot)
    home = Frame.from_transform(model.flange(robot.home))
    time = TimeScaling(TICK_S, robot.stop_rate_per_s, robot.stop_rate_change_per_s2)
    executor = Executor(robot.home, time, np.array(robot.position_min), np.array(robot.position_max))
    servo = Servo(executor, limits, robot.position_min, robot.position_max)

    def solve(time_s: float, present: Joints) -> Joints:
        angle = time_s * SPEED_M_PER_S / (1e-3 * RADIUS_MM)
        y_mm, z_mm = home.y_mm + RADIUS_MM * sin(angle), home.z_mm + RADIUS_MM * (cos(angle) - 1.0)
        return nearest.find(home._replace(y_mm=y_mm, z_mm=z_mm).to_transform(), present).joints

    turns = np.arange(1.0, SECONDS / period_s)
    arrivals = iter((period_s * (turns + chance.uniform(-JITTER, JITTER, len(turns)))).tolist())
    arrival = next(arrivals)
    solving_us, heading_us = [], []
    asked, went = [], []
    for tick in range(round(SECONDS / TICK_S)):
        while arrival <= tick * TICK_S:
            began = perf_counter()
            target = solve(arrival, executor.joints)
            solved = perf_counter()
            servo.head_for(target, limits)
            heading_us.append(1e6 * (perf_counter() - solved))
            solving_us.append(1e6 * (solved - began))
            arrival = next(arrivals, SECONDS)
        servo.step()
        executor.step()
        went.append(executor.joints)
        asked.append(solve((tick + 1) * TICK_S, executor.joints))
    behind = np.subtract(asked, went)[len(went) // 10 :]
    velocity = np.gradient(np.array(asked), TICK_S, axis=0)[len(went) // 10 :]
    return float((behind * velocity).sum() / (velocity * velocity).sum()), solving_us, heading_us
