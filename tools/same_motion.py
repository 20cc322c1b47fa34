"""Compares motion bit for bit before and after a change: digests of random programs.

`python -m tools.same_motion FILE` runs the programs and compares with the digests in FILE, or writes FILE if
it does not exist: run it before the change, and after it. A program is lines of the iiwa's protocol, or KRC4
messages for a robot of six axes, at random ticks: all kinds of moves, stops, overrides, forces. Its digest
covers the joint positions at every tick, every reply, and the end of each move.
"""

from __future__ import annotations

import random
import struct
import sys
from collections.abc import Iterable, Iterator
from hashlib import sha256
from math import degrees
from pathlib import Path

from iiwa_sim.cell.cell import Cell, load_cell, robot_alone
from iiwa_sim.frames import Frame, compose
from iiwa_sim.protocols.ports import IIWA, KRC4
from iiwa_sim.protocols.protocols import open_session
from iiwa_sim.robot.model import Model

PROGRAMS = 200
TICK_S = 0.002
LONGEST_TICKS = 15_000
"""Ticks after the last line of a program: a pause or a hold would last for ever."""
CELLS = ("table.toml", "lbr_iiwa_14_r820", "peg.toml", "lbr_iiwa_7_r800", "kr_6_r900_sixx")
EXAMPLES = Path(__file__).parent.parent / "examples"
STEERING = ("stop", "cancel move", "clear queue", "reset error", "get queue", "get error", "get goal frame")


class Quiet:
    """A log that drops its entries."""

    def wants_commands(self) -> bool:
        return False

    def __getattr__(self, _: str) -> object:
        return lambda *_, **__: None


class Program:
    """Random commands for one robot. They depend on the seed alone, not on the robot's motion."""

    def __init__(self, seed: int) -> None:
        self._picks = random.Random(seed)
        name = CELLS[seed % len(CELLS)]
        self.cell: Cell = load_cell(EXAMPLES / name) if name.endswith(".toml") else robot_alone(name)
        self._model = Model(self.cell.description)
        self.protocol = IIWA if len(self.cell.start) == 7 else KRC4
        self._kinds = self._picks.choice(
            [("normal",), ("normal", "force"), ("servo",), ("stiff",), ("normal", "servo", "stiff", "force")]
        )

    def commands(self) -> Iterator[tuple[bytes, int]]:
        """The commands, each with the number of ticks before the next."""
        for _ in range(self._picks.randrange(3, 14)):
            steers = self._picks.random() < 0.25
            text = self._message() if self.protocol == KRC4 else self._steering() if steers else self._move()
            yield text.encode() + b"\n", self._picks.choice([0, 0, 0, 1, 7, 60, 300, 1500])
        if self.protocol == IIWA:
            yield b"set override : 1\n", 0

    def _near(self) -> tuple[list[float], Frame]:
        far = self._picks.choice([0.02, 0.1, 0.3])
        joints = [value + self._picks.uniform(-far, far) for value in self.cell.start]
        return joints, Frame.from_transform(
            compose(self._model.flange(tuple(joints)), self.cell.tool_in_flange)
        )

    def _steering(self) -> str:
        if self._picks.random() < 0.4:
            return f"set override : {self._picks.choice([0.0, 0.1, 0.5, 1.0])}"
        return self._picks.choice(STEERING)

    def _move(self) -> str:
        picks = self._picks
        joints, frame = self._near()
        place, kind = _words(frame), picks.choice(self._kinds)
        speed, blending = picks.choice([1.0, 0.5, 0.1]), picks.choice([0.0, 5.0, 50.0])
        end, linear = f"{speed} {blending}", picks.choice(["lin", "ptp"])
        way = _words(picks.uniform(-60.0, 60.0) for _ in range(3)) + " 0 0 " + repr(picks.uniform(-0.2, 0.2))
        speeds = _words(picks.choice([1.0, 0.6]) for _ in joints)
        if kind == "servo":
            mode = picks.choice(["smart", "smart", "direct"])
            flange = Frame.from_transform(self._model.flange(tuple(joints)))
            return picks.choice(
                [
                    f"{mode} joint move : {_words(joints)} {speeds}",
                    f"{mode} cartesian move : {_words(flange)} {speed}",
                ]
            )
        if kind == "stiff":
            push = _words(picks.uniform(-5.0, 5.0) for _ in range(6))
            move = f"{linear}stiff move : {place} {speed} {picks.choice([200.0, 2000.0])} {push}"
            return picks.choice([move, move, move, "start gravity : 300"])
        if kind == "force":
            return picks.choice(
                [f"{linear}forcez move : {place} {end} 3", f"{linear}force move : {place} {end} 5 5 3"]
            )
        return picks.choice(
            [
                f"joint move : {_words(joints)} {speeds}",
                f"{linear} move : {place} {end}",
                f"{linear} move : {place} {end}",
                f"{linear}r move : {place} {end} {joints[2]!r}",
                f"lin joint move : {_words(joints)} {end}",
                f"{linear} relative move : {way} {end}",
                f"{linear} tool relative move : {way} {end}",
                f"is lin reachable : {place}",
            ]
        )

    def _message(self) -> str:
        joints, frame = self._near()
        if self._picks.random() < 0.2:
            return f'<Cmd I0="1" I1="{self._picks.choice([1, 100, 300, 310, 320])}"/>'
        if self._picks.random() < 0.5:
            command, values = self._picks.choice([15, 25]), list(map(degrees, joints))
        else:
            command, values = self._picks.choice([10, 20]), [*frame[:3], *map(degrees, frame[3:])]
        reals = " ".join(f'R{place}="{value!r}"' for place, value in enumerate(values))
        return f'<Cmd I0="1" I1="{command}" {reals}/>'


def _words(values: Iterable[float]) -> str:
    return " ".join(map(repr, values))


def digest(seed: int) -> str:
    """The digest of one program."""
    program = Program(seed)
    cell, seen = program.cell, sha256()
    controller = cell.controller(
        TICK_S,
        servo_timeout_s=0.5,
        on_fault=lambda code, reason: seen.update(f"fault {code} {reason}".encode()),
        on_contact=lambda contact: seen.update(f"contact {contact}".encode()),
    )
    controller.endings.listeners.append(lambda ending: seen.update(repr(tuple(ending)).encode()))
    session = open_session(program.protocol, controller, Quiet(), "a program")

    def step() -> None:
        controller.step()
        seen.update(struct.pack(f"{len(controller.joints)}d", *controller.joints))

    for text, ticks in program.commands():
        session.receive(text)
        while session.waiting:
            seen.update(session.answer())
        for _ in range(ticks):
            step()
    for _ in range(LONGEST_TICKS):
        if not controller.under_way:
            break
        step()
    session.lost()
    for _ in range(100):
        step()
    return f"{seed} {controller.tick} {controller.accepted} {seen.hexdigest()}"


def main(arguments: list[str]) -> None:
    file = Path(arguments[0])
    digests = [digest(seed) for seed in range(PROGRAMS)]
    if not file.exists():
        file.write_text("\n".join(digests) + "\n")
        print(f"{PROGRAMS} digests written")
        return
    before = file.read_text().splitlines()
    other = [now.split()[0] for now, then in zip(digests, before, strict=True) if now != then]
    print(f"{PROGRAMS - len(other)} programs move as before; otherwise: {', '.join(other) or 'none'}")
    sys.exit(bool(other))


if __name__ == "__main__":
    main(sys.argv[1:])
