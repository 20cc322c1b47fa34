"""Smart and direct moves: limits for any targets, an immediate start, and streams."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.motion.limits import JointLimits
from tests.requests import direct_joint_move, smart_joint_move
from tests.stepped import ARMS, ROBOTS, SteppedRobot, assert_within_limits, strong

Array = NDArray[np.float64]
Curve = Callable[[float], Array]

STREAMS = [pytest.param(False, 0.020, id="smart"), pytest.param(True, 0.010, id="direct")]
"""Direct mode or not, and the period of its commands (s); they come up to 0.4 periods early or late."""
JITTER = 0.4
REACH_RAD = 0.087  # of a direct target
names = st.sampled_from(ARMS)
both_modes = pytest.mark.parametrize("direct", [False, True])


class ServoRobot(SteppedRobot):
    """A robot in smart or direct mode; no torque stops it."""

    def __init__(
        self,
        direct: bool = False,
        tick_s: float = 0.002,
        robot: str = ARMS[0],
        start: Sequence[float] | Array | None = None,
    ) -> None:
        """At rest, at home if no other place is named."""
        super().__init__(strong(robot), tick_s)
        d = self.description
        acceleration, jerk = (d.direct_acceleration, d.direct_jerk) if direct else (d.acceleration, d.jerk)
        self.limits = JointLimits(np.array(d.velocity), np.array(acceleration), np.array(jerk))
        self.low, self.high, self.home = np.array(d.position_min), np.array(d.position_max), np.array(d.home)
        self._move = direct_joint_move if direct else smart_joint_move
        if start is not None:
            self.controller.place(tuple(map(float, start)))
            self.joints = [self.controller.joints]

    def heads_for(self, target: Sequence[float] | Array, speed_rel: float | Sequence[float] = 1.0) -> None:
        speeds = [speed_rel] * len(self.home) if isinstance(speed_rel, float) else speed_rel
        self.controller.move(self._move(tuple(map(float, target)), speeds))
        self.notice_mode()

    def follows(self, curve: Curve, arrivals: Sequence[float], duration_s: float) -> Array:
        """Is sent each point of a curve when the curve is there; gives how far it is behind (rad)."""
        waiting = list(arrivals)[::-1]
        behind = []
        for tick in range(round(duration_s / self.tick_s)):
            while waiting and waiting[-1] <= tick * self.tick_s:
                self.heads_for(curve(waiting.pop()))
            self.step()
            behind.append(curve((tick + 1) * self.tick_s) - self.controller.joints)
        return np.array(behind)

    def lag_s(self, speed: Array, longest_wait_s: float) -> Array:
        """The lag that docs/motion.md states for a stream with waits of up to that between two commands."""
        return speed / self.limits.acceleration + self.limits.acceleration / self.limits.jerk + longest_wait_s


def ramp(name: str, speed_rel: float | Array, duration_s: float) -> tuple[Curve, Array]:
    """Return a line of all joints through the middle of their ranges, and their speeds."""
    d = strong(name)
    low, high = np.array(d.position_min), np.array(d.position_max)
    speed = np.minimum(np.multiply(d.velocity, speed_rel), 0.95 * (high - low) / duration_s)
    return lambda t: 0.5 * (low + high) + speed * (t - duration_s / 2.0), speed


# Every target is made from the state, to find the worst.

ANYWHERE, CORNER, NEARBY, HERE, AHEAD, LIMIT_AHEAD = range(6)


def target(kind: int, robot: ServoRobot, direct: bool, rng: np.random.Generator) -> Array:
    here = np.array(robot.controller.joints)
    velocity = (here - robot.joints[-2]) / robot.tick_s if len(robot.joints) > 1 else np.zeros_like(here)
    to = {
        ANYWHERE: rng.uniform(robot.low, robot.high),
        CORNER: np.where(rng.random(len(here)) < 0.5, robot.low, robot.high),
        NEARBY: here + rng.normal(0.0, 0.02, len(here)),
        HERE: here,
        AHEAD: here + velocity * rng.uniform(0.0, 0.2),
        LIMIT_AHEAD: np.where(velocity > 0.0, robot.high, robot.low),
    }[kind]
    if direct:
        to = to.clip(here - REACH_RAD, here + REACH_RAD)
    clipped: Array = to.clip(robot.low, robot.high)
    return clipped


COMMANDS = st.lists(
    st.tuples(
        st.integers(ANYWHERE, LIMIT_AHEAD),
        st.sampled_from([1.0, 0.4, 0.05, None]),  # None: another for each joint
        st.sampled_from([0.001, 0.005, 0.02, 0.1, 0.3]),
    ),
    min_size=2,
    max_size=12,
)


@pytest.mark.requirement("FRC003")
@both_modes
@given(
    name=st.sampled_from(ROBOTS),
    rate_hz=st.sampled_from([100, 500, 1000]),
    commands=COMMANDS,
    seed=st.integers(0, 1000),
    stops=st.booleans(),
)
def test_any_targets_keep_the_limits_and_a_stop_stays_on_the_trajectory(
    name: str,
    direct: bool,
    rate_hz: int,
    commands: list[tuple[int, float | None, float]],
    seed: int,
    stops: bool,
) -> None:
    robots = ServoRobot(direct, 1.0 / rate_hz, name), ServoRobot(direct, 1.0 / rate_hz, name)
    robot, on = robots
    rng = np.random.default_rng(seed)
    to = robot.home
    for kind, speed_rel, wait_s in commands:
        to = target(kind, robot, direct, rng)
        speeds = rng.uniform(0.02, 1.0, len(to)).tolist() if speed_rel is None else speed_rel
        for each in robots if stops else (robot,):
            each.heads_for(to, speeds)
            each.step(max(round(wait_s * rate_hz), 1))
    if stops:
        before = len(robot.joints) - 1
        robot.stop()
        rest = robot.controller.motions.goal
        assert robot.runs_until_stopped() * robot.tick_s <= 0.1 + 1e-9
        assert robot.controller.joints == rest
        # The other one passes each place as well, within half of the distance of a tick.
        on.step(round(0.12 * rate_hz))
        places = np.array(on.joints[before:])
        off = [np.abs(places - q).max(axis=1).min() for q in robot.joints[before:]]
        assert max(off) <= 0.51 * np.abs(np.diff(places, axis=0)).max() + 1e-12
    else:
        robot.runs_until_stopped()
        assert robot.controller.joints == tuple(to.tolist())
    assert_within_limits(robot)


def fastest_s(distance: float, velocity: float, acceleration: float, jerk: float) -> float:
    """Return the least time from rest to rest: up to a speed, along at it, and down."""

    def up_s(speed: float) -> float:
        full = speed >= acceleration**2 / jerk
        return speed / acceleration + acceleration / jerk if full else 2.0 * (speed / jerk) ** 0.5

    slow, fast = 0.0, velocity
    if fast * up_s(fast) <= distance:
        return distance / fast + up_s(fast)
    for _ in range(60):
        speed = (slow + fast) / 2.0
        slow, fast = (speed, fast) if speed * up_s(speed) <= distance else (slow, speed)
    return 2.0 * up_s(fast)


@pytest.mark.requirement("FRA103")
@both_modes
@given(name=names, seed=st.integers(0, 10_000), share=st.sampled_from([0.001, 0.03, 1.0]))
def test_from_rest_each_joint_starts_at_once_and_arrives_as_soon_as_possible(
    direct: bool, name: str, seed: int, share: float
) -> None:
    robot = ServoRobot(direct, robot=name)
    rng = np.random.default_rng(seed)
    home = robot.home
    speeds_rel = rng.uniform(0.1, 1.0, len(home)).tolist()
    distance = share * (rng.uniform(robot.low, robot.high) - home)
    to = home + (distance.clip(-REACH_RAD, REACH_RAD) if direct else distance)
    robot.heads_for(to, speeds_rel)
    robot.step()
    assert all(np.sign(robot.controller.joints - home) == np.sign(to - home))
    robot.runs_until_stopped()
    velocity, acceleration, jerk = robot.limits.at_speed(speeds_rel)
    q = np.array(robot.joints)
    for joint, length in enumerate(np.abs(to - home)):
        least_s = fastest_s(length, velocity[joint], acceleration[joint], jerk[joint])
        arrived = int((np.abs(q[:, joint] - to[joint]) > 1e-7).sum())
        assert (arrived - 1) * robot.tick_s <= least_s <= arrived * robot.tick_s + 0.01


def test_a_target_at_the_present_position_keeps_the_robot_or_brings_it_back() -> None:
    robot = ServoRobot()
    robot.heads_for(robot.home)
    robot.step(5)
    assert set(robot.joints) == {tuple(robot.home)}
    assert not robot.controller.moving
    robot.heads_for(-0.4 * robot.home)
    robot.step(150)
    here = robot.controller.joints
    robot.heads_for(here)
    robot.runs_until_stopped()
    assert robot.controller.joints == here
    assert_within_limits(robot)


def test_a_trajectory_on_which_ruckig_fails_is_run() -> None:
    """It needs full acceleration for no time at all: four phases of 40 ms."""
    robot = ServoRobot()
    to = robot.home + 0.016 * robot.limits.velocity
    robot.heads_for(to)
    robot.runs_until_stopped()
    np.testing.assert_array_equal(robot.controller.joints, to)
    assert_within_limits(robot)


# Streams


@pytest.mark.parametrize(("direct", "period_s"), STREAMS)
@given(
    name=names,
    speeds_rel=st.lists(st.floats(0.02, 0.9), min_size=7, max_size=7),
    seed=st.integers(0, 1000),
    gap_at_s=st.none() | st.floats(0.1, 0.6),
)
def test_a_ragged_stream_is_followed_with_bounded_lag_and_never_overtaken(
    direct: bool, period_s: float, name: str, speeds_rel: list[float], seed: int, gap_at_s: float | None
) -> None:
    """Direct targets come without the gap: behind it they would be out of reach."""
    curve, speed = ramp(name, np.array(speeds_rel[: len(strong(name).home)]) * (0.2 if direct else 1.0), 0.9)
    robot = ServoRobot(direct, robot=name, start=curve(0.0))
    turns = np.arange(1.0, round(0.9 / period_s))
    times = (turns + np.random.default_rng(seed).uniform(-JITTER, JITTER, len(turns))) * period_s
    if gap_at_s is not None and not direct:
        times = times[(times <= gap_at_s) | (times > gap_at_s + 0.2)]
    behind = robot.follows(curve, times.tolist(), 0.9)
    longest_wait_s = float(np.diff([0.0, *times]).max()) + robot.tick_s
    assert (behind <= speed * robot.lag_s(speed, longest_wait_s)).all()
    robot.runs_until_stopped()
    assert (np.diff(robot.joints, axis=0) >= -1e-9).all(), "went back, or past a target"
    np.testing.assert_array_equal(robot.controller.joints, curve(times[-1]))
    assert_within_limits(robot)


@pytest.mark.requirement("FRA104")
@pytest.mark.parametrize(("direct", "period_s"), STREAMS)
@pytest.mark.parametrize(("name", "speed_rel"), [(ARMS[0], 0.02), (ARMS[0], 0.3), (ARMS[1], 0.15)])
def test_an_even_stream_is_followed_smoothly(
    direct: bool, period_s: float, name: str, speed_rel: float
) -> None:
    curve, speed = ramp(name, speed_rel, 1.5)
    robot = ServoRobot(direct, robot=name, start=curve(0.0))
    arrivals = (np.arange(1.0, round(1.5 / period_s)) * period_s).tolist()
    behind = robot.follows(curve, arrivals, 1.5)
    steady = slice(600, 740)
    lag_s = robot.lag_s(speed, 0.0) / 2.0 + period_s
    assert (behind[steady] <= speed * (lag_s + robot.tick_s)).all()
    assert (behind[steady] >= speed * 0.5 * lag_s).all()
    ripple = np.abs(np.diff(robot.joints, axis=0)[steady] / robot.tick_s / speed - 1.0)
    # The corrections between two targets grow with the acceleration the robot has.
    agility = np.divide(robot.description.acceleration, robot.description.velocity)
    assert (ripple.max(axis=0) < 0.0004 * agility.clip(min=5.0) / speed_rel).all()
