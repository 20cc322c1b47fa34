"""Refusals for the pages of commands: what a robot really says no to, found by asking it in many ways.

Each command is said in several situations (emergency stop, drives off, a gravity hold ...) with values that
may not do: too few, out of range, out of reach, beyond a joint's limit, through a singular pose. Of what is
refused one line is kept for each code and situation.
"""

from __future__ import annotations

import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import product
from math import pi
from typing import NamedTuple, Self

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.dialect.krc4.short import from_short, to_xml
from iiwa_sim.dialect.krc4.table import Command as Message
from iiwa_sim.dialect.wire.command import Command, Quantity
from iiwa_sim.dialect.wire.decimals import format_decimals
from iiwa_sim.dialect.wire.dialogue import DialogueLine
from iiwa_sim.frames import Frame, quaternion_from_rotation
from iiwa_sim.simulator import Simulator

PATIENCE_S = 60.0
SIX_AXES = "kr_6_r900_sixx"
FAREWELL = "bye"
"""The command that ends the connection, and that nothing refuses."""

FINE: dict[str, float] = {
    "speed": 0.5,
    "n": 1,
    "value": 1,
    "override": 0.5,
    "stiffness": 1000,
    "joint_stiffness": 100,
}
"""Values that do, of quantities for which 0 does not, or would not say much."""
THRESHOLD_N = 10.0
HERE = Frame(450, 0, 520, 0, -1.57079, 0)
"""Some mm from where the TCP is at home."""
NEAR = HERE._replace(y_mm=100)
FRAMES = (
    NEAR,
    HERE._replace(x_mm=2000),
    HERE._replace(x_mm=-450),
    HERE._replace(y_mm=60, alpha=pi),
    Frame(150, 0, 1306, pi, 0.5 * pi, pi),
    Frame(-180, 60, 910, -1.2, 1.1, -1.3),
)
JOINTS = (
    (0, 0.5, 0.2, -1, 0, 1.5, 0),
    (3.1, 0.5, 0.2, -1, 0, 1.5, 0),
    (0, 0, 0, 0, 0, 0, 0),
)
REDUNDANCIES = (0.0, 1.5, 2.9)
NUMBERS = (1, 17)
# Of KRC4 messages, in mm and degrees, for six axes. The first ones do, here, too.
FRAMES_DEG = (
    (445, 100, 810, 180, 0, 180),
    (9999, 0, 810, 180, 0, 180),
    (-445, 0, 810, 180, 0, 180),
    (445, 0, 810, 0, 0, 180),
    (445, 300, 500, 90, 0, 90),
)
JOINTS_DEG = (
    (10, -90, 90, 0, 80, 0),
    (180, -90, 90, 0, 80, 0),
    (0, -90, 90, 0, 0, 0),
    (0, -90, 90, 0, 90, 350),
)
IOS = ((1, 1), (99, 1), (17, 1), (1, 2))


class Refusal(NamedTuple):
    """A line that was refused."""

    code: int
    situation: str
    line: str
    told: str
    """Code and reason."""


SITUATIONS: dict[str, Callable[[Backdoor], None]] = {
    "the emergency stop is pressed": Backdoor.emergency_stop,
    "the drives are off": lambda backdoor: backdoor.switch_drives(on=False),
    "after a protective stop": Backdoor.protective_stop,
}
HOLD = "in a gravity hold"
HOLDS = "start gravity : 100"


@contextmanager
def asker() -> Iterator[Asker]:
    """Somebody who asks the default robot, in the iiwa's protocol."""
    with Simulator(clock="stepped") as simulator, LineAsker(simulator) as found:
        yield found


@contextmanager
def krc4_asker() -> Iterator[Asker]:
    """Somebody who asks a robot with six axes, in KRC4 messages."""
    with (
        Simulator(SIX_AXES, dialects=["krc4"], clock="stepped") as simulator,
        MessageAsker(simulator) as found,
    ):
        yield found


class Asker(ABC):
    """A robot in stepped time, and a driver of it."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self._why = ""  # of the last refusal: get error tells the error state first, if there is one
        simulator.dialogue.listeners.append(self._hear)
        self.socket = socket.create_connection((simulator.host, simulator.port), timeout=PATIENCE_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def refusals(self, lines: Sequence[str]) -> list[Refusal]:
        """What is refused, by code: of all lines, and of the first one in each situation."""
        found: list[Refusal] = []
        for situation in ("", *self.situations):
            for line in lines if not situation else lines[:1]:
                self._prepare(situation)
                self._why = ""
                self.say(line)
                if not self._why:
                    continue
                new = Refusal(int(self._why.split()[0]), situation, line, self._why)
                if not any(
                    new.told == each.told or (new.code, new.situation) == (each.code, each.situation)
                    for each in found
                ):
                    found.append(new)
        return sorted(found, key=lambda each: each.code)

    @property
    def situations(self) -> tuple[str, ...]:
        """Situations that the robot asked can get into."""
        return tuple(SITUATIONS)

    @abstractmethod
    def say(self, line: str) -> None:
        """Say it, and wait for the reply."""

    @abstractmethod
    def stop(self) -> None:
        """Stop the robot."""

    def _prepare(self, situation: str) -> None:
        self.stop()
        self.simulator.run_until_stopped()
        self.simulator.backdoor.restore_state("start")
        if situation in SITUATIONS:
            SITUATIONS[situation](self.simulator.backdoor)
        elif situation:
            self.say(HOLDS)

    def _hear(self, line: DialogueLine) -> None:
        self._why = line.reason or self._why


class LineAsker(Asker):
    """Speaks the iiwa's protocol."""

    def __init__(self, simulator: Simulator) -> None:
        super().__init__(simulator)
        self._replies = self.socket.makefile("rb")

    def __exit__(self, *given: object) -> None:
        self._replies.close()
        super().__exit__(*given)

    @property
    def situations(self) -> tuple[str, ...]:
        return (*SITUATIONS, HOLD)

    def say(self, line: str) -> None:
        self.socket.sendall(f"{line}\r\n".encode())
        self._replies.readline()

    def stop(self) -> None:
        self.say("stop")


class MessageAsker(Asker):
    """Speaks KRC4 messages, given in their short form."""

    def say(self, line: str) -> None:
        self.socket.sendall(to_xml(from_short(line)))
        reply = b""
        while not reply.endswith(b"</Res>"):
            reply += self.socket.recv(4096)

    def stop(self) -> None:
        self.say("Cmd I1=1")


def messages(message: Message) -> list[str]:
    """A message of KRC4 with values of many kinds, the first of which do."""
    frames = FRAMES_DEG if "R5" in message.inputs else [()]
    targets = JOINTS_DEG if message.joints == "input" else frames
    numbers = IOS if "I2" in message.inputs else [()]
    found = []
    for reals, integers in product(targets, numbers):
        values = [f"I{place}={value}" for place, value in enumerate(integers, start=2)]
        values += [f"R{place}={value:g}" for place, value in enumerate(reals)]
        found.append(" ".join(["Cmd I0=1", f"I1={message.id}", *values]))
    return found


def lines(command: Command) -> list[str]:
    """A command with values of many kinds, the first of which do; none for what ends the connection."""
    return [] if command.name == FAREWELL else list(dict.fromkeys(_lines(command)))


def _lines(command: Command) -> Iterator[str]:
    fine = _fine(command)
    for frame, joints, r, number in product(FRAMES, JOINTS, REDUNDANCIES, NUMBERS):
        different = [(frame, FRAMES), (joints, JOINTS), (r, REDUNDANCIES), (number, NUMBERS)]
        if sum(value != values[0] for value, values in different) > 1:
            continue
        yield _line(command, _with(command, fine, frame, joints, r, number))
    if command.parameters:
        yield _line(command, fine[:-1])
    for place, quantity in enumerate(command.parameters):
        if (beyond := _out_of_range(quantity)) is not None:
            yield _line(command, [*fine[:place], beyond, *fine[place + 1 :]])


def _line(command: Command, values: Sequence[float]) -> str:
    return f"{command.name} : {format_decimals(values).decode()}" if values else command.name


def _fine(command: Command) -> list[float]:
    return _with(command, [_usual(each) for each in command.parameters], FRAMES[0], JOINTS[0], 0.0, 1)


def _usual(quantity: Quantity) -> float:
    if quantity.name.startswith("threshold"):
        return THRESHOLD_N
    return 0.5 if quantity.name in {f"v{joint}" for joint in range(7)} else FINE.get(quantity.name, 0.0)


def _with(
    command: Command, values: Iterable[float], frame: Frame, joints: Sequence[float], r: float, number: int
) -> list[float]:
    """The values with another target, redundancy and number, in the places where the command has them."""
    way = Frame(*(there - here for there, here in zip(frame, HERE, strict=True)))
    quaternion = quaternion_from_rotation(frame.to_transform().rotation)
    named = dict(zip(("x", "y", "z", "alpha", "beta", "gamma"), frame, strict=True))
    named |= dict(zip(("dx", "dy", "dz", "dalpha", "dbeta", "dgamma"), way, strict=True))
    named |= dict(zip(("qx", "qy", "qz", "qw"), quaternion, strict=True))
    named |= {f"j{place}": value for place, value in enumerate(joints)}
    named |= {"r": r, "n": float(number)}
    return [named.get(each.name, value) for each, value in zip(command.parameters, values, strict=True)]


def _out_of_range(quantity: Quantity) -> float | None:
    if quantity.maximum is not None:
        return quantity.maximum + 1.0
    if quantity.minimum is not None:
        return quantity.minimum - 1.0
    return quantity.above
