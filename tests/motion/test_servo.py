"""The servo: no limit is passed wherever it is sent, it starts at once, and streams are followed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.servo import Servo
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.robot.description import load_robot
from tests.stepped import ARMS, ROBOTS, ROUNDING, TOLERANCE

Array = NDArray[np.float64]
Curve = Callable[[float], Array]

DESCRIPTIONS = {name: load_robot(name) for name in ROBOTS}
HOME = DESCRIPTIONS["lbr_iiwa_7_r800"].home
STREAMS = [pytest.param(False, 0.020, id="smart"), pytest.param(True, 0.010, id="direct")]
"""Direct mode or not, and the period of its commands (s); they come up to 0.4 periods early or late."""
JITTER = 0.4
OTHER_SIDE = tuple(-0.5 * q for q in HOME)
names = st.sampled_from(ARMS)


class Followed:
    """A servo whose every tick is recorded."""

    def __init__(
        self,
        direct: bool = False,
        tick_s: float = 0.002,
        robot: str = "lbr_iiwa_7_r800",
        start: Joints | None = None,
    ) -> None:
        """At rest, at home if no other place is named."""
        d = DESCRIPTIONS[robot]
        start = d.home if start is None else start
        acceleration, jerk = (d.direct_acceleration, d.direct_jerk) if direct else (d.acceleration, d.jerk)
        stops = (
            (d.direct_stop_acceleration, d.direct_stop_jerk) if direct else (d.stop_acceleration, d.stop_jerk)
        )
        self.limits = JointLimits(np.array(d.velocity), np.array(acceleration), np.array(jerk))
        self.stop_limits = JointLimits(self.limits.velocity, *map(np.array, stops))
        self.low, self.high = np.array(d.position_min), np.array(d.position_max)
        self.home, self.other_side = d.home, tuple(-0.4 * q for q in d.home)
        self.tick_s = tick_s
        time = TimeScaling(tick_s, d.stop_rate_per_s, d.stop_rate_change_per_s2)
        self.executor = Executor(start, time, self.low, self.high)
        self.servo = Servo(self.executor, self.limits, d.position_min, d.position_max)
        self.passed = [start]

    def heads_for(self, target: Sequence[float] | Array, speed_rel: float | Sequence[float] = 1.0) -> None:
        self.servo.head_for(tuple(map(float, target)), self.limits.at_speed(speed_rel))

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.servo.step()
            self.executor.step()
            self.passed.append(self.executor.joints)

    def runs_until_at_rest(self, limit_s: float = 60.0) -> int:
        ticks = 0
        while self.executor.moving or self.servo.asks_again:
            self.step()
            ticks += 1
            assert ticks * self.tick_s < limit_s, "still moving"
        return ticks

    def differences(self, order: int) -> Array:
        """Velocities, accelerations or jerks at every tick."""
        q = np.array([self.passed[0]] * 3 + self.passed + [self.passed[-1]] * 3)
        found: Array = np.diff(q, n=order, axis=0) / self.tick_s**order
        return found

    def assert_within_limits(self, limits: JointLimits | None = None) -> None:
        q = np.array(self.passed)
        assert (q >= self.low - ROUNDING).all()
        assert (q <= self.high + ROUNDING).all()
        limits = limits or self.limits
        for order, limit, most in zip((1, 2, 3), limits, (1.0 + ROUNDING, TOLERANCE, TOLERANCE), strict=True):
            worst = float((np.abs(self.differences(order)) / limit).max())
            assert worst <= most, f"difference {order}: {worst} of the limit"

    def follows(self, curve: Curve, arrivals: Sequence[float], duration_s: float) -> Array:
        """Is sent each point of a curve when the curve is there; gives how far it is behind (rad)."""
        waiting = list(arrivals)[::-1]
        behind = []
        for tick in range(round(duration_s / self.tick_s)):
            while waiting and waiting[-1] <= tick * self.tick_s:
                self.heads_for(curve(waiting.pop()))
            self.step()
            behind.append(curve((tick + 1) * self.tick_s) - self.executor.joints)
        return np.array(behind)

    def lag_s(self, speed: Array, longest_wait_s: float) -> Array:
        """What docs/motion.md says of a stream with waits of up to that between two commands."""
        return speed / self.limits.acceleration + self.limits.acceleration / self.limits.jerk + longest_wait_s

    def even_lag_s(self, speed: Array, period_s: float) -> Array:
        """What it says of one without jitter."""
        return self.lag_s(speed, 0.0) / 2.0 + period_s


def arrivals(period_s: float, duration_s: float, seed: int, gap_at_s: float | None = None) -> list[float]:
    """Times of commands that come early and late, and from one time on not at all for 200 ms."""
    turns = np.arange(1.0, round(duration_s / period_s))
    turns += np.random.default_rng(seed).uniform(-JITTER, JITTER, len(turns))
    times = turns * period_s
    if gap_at_s is not None:
        times = times[(times <= gap_at_s) | (times > gap_at_s + 0.2)]
    found: list[float] = times.tolist()
    return found


def even_arrivals(period_s: float, duration_s: float) -> list[float]:
    found: list[float] = (np.arange(1.0, round(duration_s / period_s)) * period_s).tolist()
    return found


def longest_wait_s(times: Sequence[float], tick_s: float) -> float:
    return float(np.diff([0.0, *times]).max()) + tick_s


def middle(name: str) -> Array:
    """Of the range of each joint."""
    d = DESCRIPTIONS[name]
    return 0.5 * np.add(d.position_min, d.position_max)


def widest(name: str) -> Array:
    """How far each joint may go, from one end of its range nearly to the other."""
    d = DESCRIPTIONS[name]
    return 0.95 * np.subtract(d.position_max, d.position_min)


def ramp(name: str, velocity: Array, duration_s: float) -> Curve:
    """All joints through the middle of their ranges, each at its own speed."""
    return lambda t: middle(name) + velocity * (t - duration_s / 2.0)


# Where it is sent: every target is made from the state, to find what is worst.


ANYWHERE, CORNER, NEARBY, HERE, AHEAD, LIMIT_AHEAD = range(6)


def target(kind: int, robot: Followed, rng: np.random.Generator) -> Array:
    here = np.array(robot.executor.joints)
    velocity = (here - robot.passed[-2]) / robot.tick_s if len(robot.passed) > 1 else np.zeros_like(here)
    to = {
        ANYWHERE: rng.uniform(robot.low, robot.high),
        CORNER: np.where(rng.random(len(here)) < 0.5, robot.low, robot.high),
        NEARBY: here + rng.normal(0.0, 0.02, len(here)),
        HERE: here,
        AHEAD: here + velocity * rng.uniform(0.0, 0.2),
        LIMIT_AHEAD: np.where(velocity > 0.0, robot.high, robot.low),
    }[kind]
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


@pytest.mark.parametrize(("direct", "rate_hz"), [(False, 500), (True, 500), (False, 1000), (True, 100)])
@given(robot_name=st.sampled_from(list(DESCRIPTIONS)), commands=COMMANDS, seed=st.integers(0, 1000))
def test_no_limit_is_passed_wherever_it_is_sent(
    robot_name: str, direct: bool, rate_hz: int, commands: list[tuple[int, float | None, float]], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    robot = Followed(direct, 1.0 / rate_hz, robot_name)
    for kind, speed_rel, wait_s in commands:
        to = target(kind, robot, rng)
        robot.heads_for(to, rng.uniform(0.02, 1.0, len(to)).tolist() if speed_rel is None else speed_rel)
        robot.step(max(round(wait_s * rate_hz), 1))
    robot.heads_for(to)
    robot.runs_until_at_rest()
    assert robot.executor.joints == tuple(to.tolist()) == robot.executor.rest
    robot.assert_within_limits()


@given(
    name=names,
    runs_s=st.floats(0.0, 0.6),
    each=st.lists(st.floats(0.02, 1.0), min_size=7, max_size=7),
)
def test_a_lower_speed_is_reached_by_braking(name: str, runs_s: float, each: list[float]) -> None:
    robot = Followed(robot=name)
    speeds_rel = each[: len(robot.home)]
    robot.heads_for(robot.other_side)
    robot.step(round(runs_s / robot.tick_s))
    robot.heads_for(robot.other_side, speeds_rel)
    before = len(robot.passed)
    robot.runs_until_at_rest()
    robot.assert_within_limits()
    lower = robot.limits.velocity * speeds_rel
    braking_s = (
        robot.limits.velocity / robot.limits.acceleration
        + 2.0 * robot.limits.acceleration / robot.limits.jerk
    )
    braked = before + round(float(braking_s.max()) / robot.tick_s)
    velocities = np.abs(np.diff(robot.passed, axis=0)) / robot.tick_s
    assert (velocities[braked:] <= lower * (1.0 + ROUNDING)).all()


def fastest_s(way: float, velocity: float, acceleration: float, jerk: float) -> float:
    """The least time from rest to rest: up to a speed, along at it, and down."""

    def up_s(speed: float) -> float:
        full = speed >= acceleration**2 / jerk
        return speed / acceleration + acceleration / jerk if full else 2.0 * (speed / jerk) ** 0.5

    slow, fast = 0.0, velocity
    if fast * up_s(fast) <= way:
        return way / fast + up_s(fast)
    for _ in range(60):
        speed = (slow + fast) / 2.0
        slow, fast = (speed, fast) if speed * up_s(speed) <= way else (slow, speed)
    return 2.0 * up_s(fast)


@pytest.mark.requirement("FRA103")
@pytest.mark.parametrize("direct", [False, True])
@given(name=names, seed=st.integers(0, 10_000), share=st.sampled_from([0.001, 0.03, 1.0]))
def test_from_rest_it_starts_at_once_and_each_joint_arrives_as_soon_as_can_be(
    direct: bool, name: str, seed: int, share: float
) -> None:
    robot = Followed(direct, robot=name)
    rng = np.random.default_rng(seed)
    home = np.array(robot.home)
    speeds_rel = rng.uniform(0.1, 1.0, len(home))
    to = home + share * (rng.uniform(robot.low, robot.high) - home)
    robot.heads_for(to, speeds_rel.tolist())
    robot.step()
    assert all(np.sign(robot.executor.joints - home) == np.sign(to - home))
    robot.runs_until_at_rest()
    velocity, acceleration, jerk = robot.limits.at_speed(speeds_rel.tolist())
    q = np.array(robot.passed)
    for joint, way in enumerate(np.abs(to - home)):
        least_s = fastest_s(way, velocity[joint], acceleration[joint], jerk[joint])
        arrived = int((np.abs(q[:, joint] - to[joint]) > 1e-7).sum())
        assert (arrived - 1) * robot.tick_s <= least_s <= arrived * robot.tick_s + 0.01


@pytest.mark.requirement("FRA103")
@pytest.mark.parametrize("direct", [False, True])
@given(name=names, share=st.floats(0.0, 1.0), ticks=st.integers(1, 10))
def test_under_way_a_new_target_counts_from_the_next_tick(
    direct: bool, name: str, share: float, ticks: int
) -> None:
    """All joints at a steady speed brake with full jerk from the very tick on."""
    half = 0.4 * widest(name)
    start = tuple((middle(name) - half).tolist())
    turned, on = Followed(direct, robot=name, start=start), Followed(direct, robot=name, start=start)
    speed_rel = float((half / 0.6 / turned.limits.velocity).clip(max=1.0).min())
    accelerating_s = float(
        (speed_rel * turned.limits.velocity / turned.limits.acceleration).max()
        + (turned.limits.acceleration / turned.limits.jerk).max()
    )
    for robot in (turned, on):
        robot.heads_for(middle(name) + half, speed_rel)
        robot.step(round((accelerating_s + 0.02 + 0.1 * share) / robot.tick_s))
    turned.heads_for(start)
    turned.step(ticks)
    on.step(ticks)
    behind = np.subtract(on.executor.joints, turned.executor.joints)
    np.testing.assert_allclose(behind, on.limits.jerk * (ticks * on.tick_s) ** 3 / 6.0, rtol=1e-5)


@pytest.mark.parametrize("name", ARMS)
def test_sent_where_it_is_it_stays_or_comes_back(name: str) -> None:
    robot = Followed(robot=name)
    robot.heads_for(robot.home)
    robot.step(5)
    assert set(robot.passed) == {robot.home}
    assert not robot.executor.moving
    robot.heads_for(robot.other_side)
    robot.step(150)
    here = robot.executor.joints
    robot.heads_for(here)
    robot.runs_until_at_rest()
    assert robot.executor.joints == here
    robot.assert_within_limits()


# Streams.


SPEEDS = st.lists(st.floats(0.02, 0.9), min_size=7, max_size=7)


@pytest.mark.parametrize(("direct", "period_s"), STREAMS)
@given(name=names, speeds_rel=SPEEDS, seed=st.integers(0, 1000), gap_at_s=st.none() | st.floats(0.1, 0.8))
def test_a_ragged_stream_is_followed_with_bounded_lag_and_never_overtaken(
    direct: bool, period_s: float, name: str, speeds_rel: list[float], seed: int, gap_at_s: float | None
) -> None:
    limits = DESCRIPTIONS[name].velocity
    speed = np.minimum(np.multiply(limits, speeds_rel[: len(limits)]), widest(name) / 1.2)
    curve = ramp(name, speed, 1.2)
    robot = Followed(direct, robot=name, start=tuple(curve(0.0).tolist()))
    times = arrivals(period_s, 1.2, seed, gap_at_s)
    behind = robot.follows(curve, times, 1.2)
    lag_s = robot.lag_s(speed, longest_wait_s(times, robot.tick_s))
    assert (behind <= speed * lag_s).all()
    robot.runs_until_at_rest()
    assert (np.diff(robot.passed, axis=0) >= -1e-9).all(), "went back, or past a target"
    np.testing.assert_array_equal(robot.executor.joints, curve(times[-1]))
    robot.assert_within_limits()


@pytest.mark.requirement("FRA104")
@pytest.mark.parametrize(("direct", "period_s"), STREAMS)
@pytest.mark.parametrize(
    ("name", "speed_rel"),
    [(ARMS[0], 0.02), (ARMS[0], 0.8), (ARMS[1], 0.3)],
)
def test_an_even_stream_is_followed_smoothly(
    direct: bool, period_s: float, name: str, speed_rel: float
) -> None:
    speed = speed_rel * np.array(DESCRIPTIONS[name].velocity)
    curve = ramp(name, speed, 1.5)
    robot = Followed(direct, robot=name, start=tuple(curve(0.0).tolist()))
    behind = robot.follows(curve, even_arrivals(period_s, 1.5), 1.5)
    steady = slice(600, 740)
    lag_s = robot.even_lag_s(speed, period_s)
    assert (behind[steady] <= speed * (lag_s + robot.tick_s)).all()
    assert (behind[steady] >= speed * 0.5 * lag_s).all()
    ripple = np.abs(np.diff(robot.passed, axis=0)[steady] / robot.tick_s / speed - 1.0)
    # What it corrects between two targets grows with the acceleration it has.
    agility = np.divide(DESCRIPTIONS[name].acceleration, DESCRIPTIONS[name].velocity)
    assert (ripple.max(axis=0) < 0.0004 * agility.clip(min=5.0) / speed_rel).all()


@pytest.mark.parametrize(("direct", "period_s"), STREAMS)
@given(name=names, seed=st.integers(0, 1000))
def test_a_stream_of_steps_breaks_no_limit_and_each_last_step_is_reached(
    direct: bool, period_s: float, name: str, seed: int
) -> None:
    robot = Followed(direct, robot=name)
    rng = np.random.default_rng(seed)
    steps = np.array(robot.home) + rng.uniform(-0.5, 0.5, (6, len(robot.home)))
    robot.follows(lambda t: steps[min(int(t / 0.3), 5)], arrivals(period_s, 1.8, seed), 1.8)
    robot.runs_until_at_rest()
    np.testing.assert_array_equal(robot.executor.joints, steps[5])
    robot.assert_within_limits()


# Stops.


@pytest.mark.requirement("FRC003")
@pytest.mark.parametrize("direct", [False, True])
@given(name=names, commands=COMMANDS, seed=st.integers(0, 1000))
def test_a_stop_takes_100_ms_at_most_and_stays_on_the_course(
    direct: bool, name: str, commands: list[tuple[int, float | None, float]], seed: int
) -> None:
    stopped, on = Followed(direct, robot=name), Followed(direct, robot=name)
    rng = np.random.default_rng(seed)
    for kind, _, wait_s in commands:
        to = target(kind, stopped, rng)
        for robot in (stopped, on):
            robot.heads_for(to)
            robot.step(max(round(wait_s / robot.tick_s), 1))
    before = len(stopped.passed) - 1
    foreseen = stopped.executor.rest_after_stop()
    stopped.executor.stop()
    assert stopped.executor.rest == foreseen
    assert stopped.runs_until_at_rest() * stopped.tick_s <= 0.1
    assert stopped.executor.joints == stopped.executor.rest == foreseen
    stopped.step(3)
    stopped.assert_within_limits(stopped.stop_limits)
    # Each place was passed by the other one as well, between two ticks: less than half a tick's way from one.
    on.step(60)
    course = np.array(on.passed[before:])
    off = [np.abs(course - q).max(axis=1).min() for q in stopped.passed[before:]]
    assert max(off) <= 0.51 * np.abs(np.diff(course, axis=0)).max()


# Where Ruckig finds no course, or none that serves.


def test_a_way_on_which_ruckig_fails_is_run() -> None:
    """It needs full acceleration for no time at all: four phases of 40 ms."""
    robot = Followed()
    robot.heads_for(HOME + 0.016 * robot.limits.velocity)
    robot.runs_until_at_rest()
    np.testing.assert_array_equal(robot.executor.joints, HOME + 0.016 * robot.limits.velocity)
    robot.assert_within_limits()


@given(name=names, runs=st.integers(150, 450), softer=st.floats(0.1, 0.5))
def test_limits_that_become_lower_on_the_way_to_a_position_limit_do_not_lead_beyond_it(
    name: str, runs: int, softer: float
) -> None:
    robot = Followed(robot=name)
    robot.heads_for(robot.high)
    robot.step(runs)
    limits = robot.limits._replace(
        acceleration=softer * robot.limits.acceleration, jerk=softer * robot.limits.jerk
    )
    robot.servo.head_for(tuple(robot.high.tolist()), limits)
    robot.runs_until_at_rest()
    assert robot.executor.joints == tuple(robot.high.tolist())
    robot.assert_within_limits()


@pytest.mark.parametrize("runs", [0, 100])
def test_where_there_is_no_course_at_all_it_comes_to_rest_and_takes_new_targets(runs: int) -> None:
    robot = Followed()
    if runs:
        robot.heads_for(OTHER_SIDE)
        robot.step(runs)
        robot.heads_for(2.0 * robot.high)
        with pytest.raises(ArithmeticError):
            robot.runs_until_at_rest()
        assert robot.executor.joints == robot.executor.rest == OTHER_SIDE
    else:
        with pytest.raises(ArithmeticError):
            robot.heads_for(2.0 * robot.high)
        assert robot.executor.joints == robot.executor.rest == HOME
    assert not robot.executor.moving
    robot.heads_for(robot.low)
    robot.runs_until_at_rest()
    assert robot.executor.joints == tuple(robot.low.tolist())
    robot.assert_within_limits()
