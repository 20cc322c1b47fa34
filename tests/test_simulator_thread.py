"""The simulator in a thread of its own, as programs have it that know no asyncio."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.clock.clock import StillMoving
from iiwa_sim.simulator import Simulator
from tests.requests import gravity_hold, joint_move

THERE = [1, 1, 1, -1.5, 1, 1, 1]
SLOWLY = [0.06] * 7  # some ten seconds


def left() -> tuple[int, list[str]]:
    return threading.active_count(), sorted(path.name for path in Path("/proc/self/fd").iterdir())


def test_a_ready_simulator_listens_and_leaves_nothing_at_its_end() -> None:
    before = left()
    for _ in range(10):
        with (
            Simulator(clock="fast", status_port=0) as simulator,
            Iiwa(simulator.host, simulator.port) as robot,
        ):
            robot.hello()
            robot.joint_move(THERE, SLOWLY)
    assert left() == before


@pytest.mark.requirement("FRA101")
def test_a_move_of_ten_seconds_is_run_at_once() -> None:
    with Simulator(clock="stepped") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        robot.joint_move(THERE, SLOWLY)
        assert robot.get_status() == "moving"
        home = simulator.joints
        assert simulator.state().tick == 0, "nothing moves without a command"
        simulator.advance(1.0)
        assert simulator.state().time_s == 1.0
        assert simulator.joints != home
        with pytest.raises(StillMoving):
            simulator.run_until_stopped(limit_s=1.0)
        seconds = simulator.run_until_stopped()
        assert 5.0 < seconds < 10.0
        assert simulator.state().time_s == pytest.approx(seconds + 2.0)
        assert robot.get_status() == "stopped"
        assert simulator.joints == tuple(map(float, THERE))
        assert simulator.run_until_stopped() == 0.0


def test_time_is_paused_and_its_pace_changed() -> None:
    with Simulator(clock="fast") as simulator, Iiwa(simulator.host, simulator.port) as robot:
        simulator.pause()
        robot.joint_move(THERE, SLOWLY)
        tick = simulator.state().tick
        robot.get_status()
        assert simulator.state().tick == tick
        simulator.set_clock("10x")
        simulator.set_clock("fast")
        assert simulator.state().tick == tick, "still paused"
        simulator.resume()
        robot.wait_until_stopped(timeout_s=60)
        with pytest.raises(ValueError, match="expected real"):
            simulator.set_clock("slow")


def test_a_caller_that_waits_for_time_gets_an_error_when_the_robot_ends() -> None:
    raised = list[str]()

    def wait(simulator: Simulator) -> None:
        try:
            simulator.advance(86400.0)
        except RuntimeError as fault:
            raised.append(str(fault))

    with Simulator(clock="stepped") as simulator:
        # Not at rest, a day of which would be over at once.
        simulator.call(lambda: simulator.controller.move(gravity_hold(1000.0)))
        thread = threading.Thread(target=wait, args=(simulator,))
        thread.start()
        while simulator.state().tick == 0:
            pass
    thread.join(60)
    assert len(raised) == 1


def test_an_exit_in_the_robots_thread_is_that_of_its_caller() -> None:
    with Simulator(clock="stepped") as simulator:
        with pytest.raises(SystemExit):
            simulator.call(sys.exit)
        assert simulator.state().tick == 0


async def test_inside_a_loop_time_is_awaited() -> None:
    async with Simulator(clock="stepped") as simulator:
        with pytest.raises(RuntimeError, match="await the methods of `clock`"):
            simulator.advance(1.0)
        await simulator.clock.advance(1.0)
        assert simulator.state().tick == 500
        simulator.call(lambda: simulator.controller.move(joint_move(THERE, SLOWLY)))
        assert await simulator.clock.run_until_stopped(60.0) > 9.0
        assert simulator.joints == tuple(map(float, THERE))


@pytest.mark.filterwarnings("ignore:.* is multi-threaded, use of fork:DeprecationWarning")  # from 3.12 on
def test_a_forked_process_has_no_robot() -> None:
    with Simulator() as simulator:
        child = os.fork()
        if child == 0:
            try:
                simulator.advance(1.0)
            except RuntimeError as fault:
                os._exit(0 if "was forked from" in str(fault) else 1)
            os._exit(1)
        assert os.waitpid(child, 0) == (child, 0)
        simulator.advance(1.0)
