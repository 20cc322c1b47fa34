"""Random mixes of all commands of the text protocol, and a robot that gets them at any tick."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np

from iiwa_sim.frames import Frame, quaternion_from_rotation
from iiwa_sim.protocols.table import Command, load_table
from tests.journal import Journal
from tests.protocols.fake_robot import Conversation
from tests.stepped import SteppedRobot

TABLE = load_table("iiwa")
MIXED = [command for name, command in TABLE.commands.items() if name not in ("bye", "help")]
MODES = ("normal", "normal", "impedance", "smart", "direct")
LOYALTY = 0.9  # probability that a mode stays
STEERING = ("stop", "set override", "clear queue", "cancel move")
HOLD = "start gravity"
EMERGENCY = "emergency stop"  # nothing on the wire presses it
RUBBISH = ("1e308", "-1e308", "1e400", "5e-324", "-0", "nan", "1_0", "0x10", "0.5.5", "")


class Mix:
    """Robot that gets random commands, with its exchanges and accepted moves."""

    def __init__(self, seed: int, tick_s: float, *, forces: bool, skips: bool = False) -> None:
        """With `forces`, stiffness moves have some that push the robot off its plan.

        With `skips` it leaves out the ticks of a robot at rest, as a clock does.
        """
        self._skips = skips
        self._random = random.Random(seed)
        self._forces = forces
        self.robot = SteppedRobot(tick_s=tick_s)
        self.journal = Journal()
        self._conversation = Conversation(self.robot.controller, self.journal)
        self.exchanges: list[tuple[int, str, str]] = []
        self._mode = "normal"
        self._pending: set[int] = set()
        self._done: set[int] = set()

    def run(self, commands: int) -> None:
        """Send so many lines at any ticks, then waits until the robot rests."""
        for _ in range(commands):
            self._send(self._line())
            if self._random.random() < 0.2:
                self._wait_until_stopped()
            self.step(self._random.choice([0, 0, 0, 1, 2, 3, self._random.randrange(100)]))
        self._send("set override : 1")
        self.step(5)
        if self.robot.controller.mode.value == "impedance":
            self._send("stop")  # a hold would last for ever
        self.robot.runs_until_stopped()
        self._check()
        self.step(5)

    def step(self, ticks: int) -> None:
        for _ in range(ticks):
            if self._skips and self.robot.controller.resting:
                self.robot.controller.skip(1)
                self.robot.joints.append(self.robot.controller.joints)
            else:
                self.robot.step()
            self._check()

    def _wait_until_stopped(self) -> None:
        """Wait until the robot stops, for a second at most: a pause or a hold would last for ever."""
        for _ in range(round(1.0 / self.robot.tick_s)):
            if not self.robot.controller.moving:
                break
            self.step(1)

    def _send(self, line: str) -> None:
        """Send a line and check its reply; a rejected line drops no move."""
        robot, controller = self.robot, self.robot.controller
        robot.notice_mode()
        if line == EMERGENCY:
            controller.emergency_stop()
            robot.may_stop()
            controller.emergency_stop(pressed=False)
            line = "reset error"
        waiting, mode = set(self._still_pending()), controller.mode
        before = controller.accepted
        reply = self._conversation.ask(line)
        self.exchanges.append((controller.tick, line, reply))
        assert not self.journal.faults, line
        if reply in ("error", "unknown command"):
            assert waiting == set(self._still_pending()), line
            assert (controller.mode, controller.accepted) == (mode, before)
        if line in ("stop", "cancel move", "clear queue") or line.startswith(HOLD):
            robot.may_stop()
        self._pending |= set(range(before + 1, controller.accepted + 1))
        robot.notice_mode()
        self._check()

    def _still_pending(self) -> Iterator[int]:
        return filter(self.robot.controller.motions.is_pending, sorted(self._pending))

    def _check(self) -> None:
        controller = self.robot.controller
        pending = set(self._still_pending())
        self._done |= self._pending - pending
        self._pending = pending
        assert not any(map(controller.motions.is_pending, self._done)), "what is done, or forgotten, stays so"
        assert controller.moving or not pending
        assert controller.motions.behind in (len(pending), len(pending) - 1)

    def _line(self) -> str:
        """Return a command with parameters that often make sense."""
        picks = self._random
        if picks.random() < 0.01:
            return EMERGENCY
        if picks.random() > LOYALTY:
            self._mode = picks.choice(MODES)
        command = picks.choices(MIXED, [self._weight(command) for command in MIXED])[0]
        values = self._values(command)
        words = [repr(values[each.name]) for each in command.parameters]
        if words and picks.random() < 0.03 and (self._forces or command.mode != "impedance"):
            words[picks.randrange(len(words))] = picks.choice(RUBBISH)
        return f"{command.name} : {' '.join(words)}" if words else command.name

    def _weight(self, command: Command) -> float:
        if command.mode == "any":
            return 2.0 if command.name in STEERING else 0.3
        if command.name == HOLD:
            return 1.0 if self._mode == "impedance" else 0.0  # it does not end by itself
        moves = sum(each.mode == self._mode for each in MIXED)
        return 30.0 / moves if command.mode == self._mode else 0.0

    def _values(self, command: Command) -> dict[str, float]:
        """Return a value for each parameter there is."""
        robot, picks = self.robot, self._random
        d, controller = robot.description, robot.controller
        near = 0.08 if command.mode == "direct" else picks.choice([1e-9, 1e-4, 0.05, 0.3, 0.8])
        joints = np.array(controller.joints if command.mode == "direct" else controller.end_of_queue)
        joints = joints + near * np.array([picks.uniform(-1.0, 1.0) for _ in joints])
        joints = np.clip(joints, d.position_min, d.position_max)
        pose = robot.model.flange(joints) if command.mode in ("smart", "direct") else robot.tcp(joints)
        frame = Frame.from_transform(pose)
        distance, turn = picks.choice([0.0, 1e-6, 5.0, 80.0]), picks.choice([0.0, 1e-6, 0.3])
        push = picks.choice([0.0, 3.0, 30.0]) if self._forces else 0.0
        values = dict(zip(("x", "y", "z", "alpha", "beta", "gamma"), frame, strict=True))
        quaternion = quaternion_from_rotation(pose.rotation)
        values |= dict(zip(("qx", "qy", "qz", "qw"), quaternion, strict=True))
        for k, joint in enumerate(joints.tolist()):
            values |= {f"j{k}": joint, f"v{k}": self._speed()}
        for axis in "xyz":
            values |= {f"d{axis}": distance * picks.uniform(-1.0, 1.0), f"threshold{axis.upper()}": 5.0}
            values |= {f"f{axis}": push * picks.uniform(-1.0, 1.0), f"t{axis}": 0.1 * push}
        values |= {f"d{angle}": turn * picks.uniform(-1.0, 1.0) for angle in ("alpha", "beta", "gamma")}
        return values | {
            "r": float(joints[2]),
            "speed": self._speed(),
            "blending": picks.choice([0.0, 5.0, 50.0, 500.0, 1e300]),
            "stiffness": picks.choice([0.0, 100.0, 2000.0, 5000.0]),
            "joint_stiffness": 1000.0,
            "override": picks.choice([0.0, 1.0, 0.5, 1e-12, picks.random()]),
            "n": picks.choice([0.0, 1.0, 16.0, 17.0, 1e300]),
            "value": 1.0,
            "max_force": 0.0,  # off: what a collision does is tested by itself
            "max_torque": 0.0,
            "mass": 0.0,
            "cx": 0.0,
            "cy": 0.0,
            "cz": 50.0,
        }

    def _speed(self) -> float:
        return self._random.choice([1.0, 1.0, 0.5, 0.1])
