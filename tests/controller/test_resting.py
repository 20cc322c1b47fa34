"""A robot at rest may leave out ticks: it is then what it would have been with them, bit for bit."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.noise import Noise, NoiseLevels
from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import ErrorRecord, Refused
from iiwa_sim.controller.state import snapshot
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from tests.asked import (
    direct_joint_move,
    gravity_hold,
    joint_move,
    lin_force_move,
    lin_move,
    lin_stiff_move,
    smart_joint_move,
)
from tests.stepped import ARMS

TICK_S = 0.002
SERVO_TIMEOUT_S = 0.3
WAITS = (0, 1, 2, 3, 20, 400, 1500)
RADIUS_M = 0.01
DOWN = Frame(0.0, 0.0, 0.0, 0.0, np.pi, 0.0)


class Robot:
    """A controller, and everything it has told."""

    def __init__(self, name: str) -> None:
        description = load_robot(name)
        self.told: list[Any] = []
        self.skipped = 0
        self.controller = Controller(
            description,
            TICK_S,
            world=TcpContact((), RADIUS_M),
            noise=Noise(NoiseLevels(7, 0.5, 0.02, 0.1), len(description.joints)),
            servo_timeout_s=SERVO_TIMEOUT_S,
            on_fault=lambda *fault: self._tell(fault),
            on_contact=self._tell,
        )
        self.controller.endings.listeners.append(self._tell)

    def tick(self, ticks: int) -> None:
        for _ in range(ticks):
            self.controller.step()

    def tick_or_skip(self, ticks: int) -> None:
        """Make ticks, but leave out those at rest: in up to three parts, as if somebody had looked."""
        while ticks:
            if self.controller.resting:
                part = max(1, ticks // 3)
                self.controller.skip(part)
                self.skipped += part
            else:
                part = 1
                self.controller.step()
            ticks -= part

    def does(self, action: Callable[[Controller], object]) -> None:
        try:
            self.told.append(action(self.controller))
        except Refused as refused:
            self.told.append(refused.reason)

    def _tell(self, what: object) -> None:
        self.told.append((self.controller.tick, what))


class Program:
    """Random things to be done to a robot, each with ticks behind it; the same for every robot."""

    def __init__(self, seed: int, length: int) -> None:
        self._picks = random.Random(seed)
        self.steps = [(self._action(), self._picks.choice(WAITS)) for _ in range(length)]

    def _action(self) -> Callable[[Controller], object]:
        picks = self._picks
        sizes = picks.choices([0.003, 0.02, 0.2], k=1)[0]
        way = [sizes * picks.uniform(-1.0, 1.0) for _ in range(7)]
        speed = picks.choice([1.0, 1.0, 0.3])
        depth_mm, number = picks.uniform(0.0, 3.0), picks.randrange(1, 5)
        force, override = picks.uniform(-20.0, 20.0), picks.choice([1.0, 1.0, 0.4, 0.0])

        def joints(c: Controller) -> list[float]:
            return [a + b for a, b in zip(c.end_of_queue, way, strict=False)]

        def lower(c: Controller) -> Frame:
            here = c.tcp_frame_at(c.end_of_queue)
            return here._replace(x_mm=here.x_mm + 100.0 * way[0], z_mm=here.z_mm - depth_mm)

        def floor(c: Controller) -> None:
            """Under the TCP, which the next LIN presses into it, or which is in it already."""
            top = c.tool_frame().z_mm - 1e3 * RADIUS_M + picks_depth
            pose = Frame(0.0, 0.0, top, 0.0, 0.0, 0.0).to_transform()
            c.load.world.put(Surface(f"floor {number}", Plane(), pose, 3000.0, 0.3, 0.5))

        picks_depth = picks.choice([-0.5, 0.0, 0.7])

        def no_floor(c: Controller) -> None:
            for name in list(c.load.world.surfaces)[:1]:
                c.load.world.remove(name)

        actions: list[Callable[[Controller], object]] = [
            *[lambda c: c.move(joint_move(joints(c), [speed] * len(c.joints)))] * 3,
            *[lambda c: c.move(lin_move(lower(c), speed, 5.0))] * 3,
            lambda c: c.move(lin_force_move(lower(c), speed, 0.0, (None, None, 2.0))),
            lambda c: c.move(lin_stiff_move(lower(c), speed, 2000.0, (0.0,) * 6)),
            lambda c: c.move(gravity_hold(500.0)),
            lambda c: c.move(smart_joint_move(joints(c), [speed] * len(c.joints))),
            lambda c: c.move(direct_joint_move(joints(c), [speed] * len(c.joints))),
            *[lambda c: c.stop()] * 3,
            lambda c: c.cancel_move(),
            lambda c: c.clear_queue(),
            lambda c: c.set_override(override),
            lambda c: c.set_override(1.0),
            lambda c: c.io.set_output(number, bool(number % 2)),
            lambda c: c.emergency_stop(),
            lambda c: (c.release_emergency_stop(), c.reset_error()),
            lambda c: c.reset_error(),
            lambda c: c.switch_drives(bool(number % 2)),
            lambda c: setattr(c.errors, "next_refusal", ErrorRecord(5, "as a test wants it")),
            lambda c: setattr(c.load, "wrench", (0.0, 0.0, force, 0.0, 0.0, 0.0)),
            lambda c: setattr(c.load, "joint_push", (0.0,) * len(c.joints)),
            lambda c: c.load.seed(number),
            *[floor] * 2,
            no_floor,
            lambda c: c.place(joints(c)),
            lambda c: c.set_tool(Frame(0.0, depth_mm, 100.0, 0.0, 0.0, 0.0).to_transform()),
        ]
        return picks.choice(actions)


def assert_alike(name: str, seed: int, length: int) -> int:
    """Runs a program on a robot that ticks and on one that skips; gives how many ticks that left out."""
    ticked, skipping = Robot(name), Robot(name)
    for action, wait in Program(seed, length).steps:
        for robot in (ticked, skipping):
            robot.does(action)
        ticked.tick(wait)
        skipping.tick_or_skip(wait)
        assert snapshot(skipping.controller) == snapshot(ticked.controller)
        assert skipping.controller.queue == ticked.controller.queue
        assert skipping.told == ticked.told
    return skipping.skipped


@pytest.mark.parametrize("name", ARMS)
@settings(suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32))
def test_a_robot_that_leaves_out_its_rest_is_the_one_that_ticks_bit_for_bit(name: str, seed: int) -> None:
    assert_alike(name, seed, 12)
