"""Prints the files that a command passes from the socket to the queue, and a tick from the clock to the
joints.

`python -m tools.walk` counts for a `lin move` on a robot at rest, observed by `sys.setprofile` while a client
sends the line over TCP; with `--all` it prints both walks. A file is entered by each call from another file.
Compiled kernels do not show: the profiler sees Python only.
"""

from __future__ import annotations

import asyncio
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import NamedTuple

import iiwa_sim
from iiwa_sim.simulator import Simulator

ROOM = Path(iiwa_sim.__file__).parent
ELSEWHERE = ""
RISE_MM = 20.0
TICKS = 200
"""Ticks of the move that are looked at; it takes longer."""


class Step(NamedTuple):
    """A call that leads into a file from another one."""

    depth: int
    file: str
    """Under iiwa_sim."""
    function: str


class Walk:
    """Records the calls of one thread, from `start` to `end`."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self.calls = 0
        self._stack: list[str] = []

    def __enter__(self) -> Walk:
        sys.setprofile(self._profile)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    @property
    def files(self) -> Counter[str]:
        """How often each file is entered."""
        return Counter(step.file for step in self.steps)

    def _profile(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            self._enter(_file_of(frame.f_code.co_filename), frame.f_code.co_name)
        elif event == "return" and self._stack:
            self._stack.pop()

    def _enter(self, file: str, function: str) -> None:
        before = next((each for each in reversed(self._stack) if each), ELSEWHERE)
        self._stack.append(file)
        if file:
            self.calls += 1
            if file != before:
                self.steps.append(Step(sum(map(bool, self._stack)) - 1, file, function))


def _file_of(path: str) -> str:
    return path.removeprefix(f"{ROOM}/") if path.startswith(f"{ROOM}/") else ELSEWHERE


async def walks() -> tuple[Walk, list[Walk]]:
    """The walk of the command, and those of the first ticks of its move."""
    async with Simulator(clock="stepped") as simulator:
        controller = simulator.controller
        x, y, z, *angles = controller.tool_frame()
        line = f"lin move : {x} {y} {z - RISE_MM} {' '.join(map(str, angles))} 0.5 0\r\n"
        reader, writer = await asyncio.open_connection(simulator.host, simulator.port)
        writer.write(b"hello\r\n")
        await reader.readline()
        with Walk() as command:
            writer.write(line.encode())
            await reader.readline()
        ticks = []
        for _ in range(TICKS):
            with Walk() as tick:
                controller.step()
            ticks.append(tick)
        writer.close()
        await writer.wait_closed()
    return command, ticks


def written(walk: Walk) -> str:
    """One line for each step, indented as calls are."""
    return "\n".join(f"{'  ' * step.depth}{step.file}: {step.function}" for step in walk.steps)


def summary(name: str, walk: Walk) -> str:
    """How many calls, files and entries into files."""
    return f"{name}: {walk.calls} calls, {len(walk.files)} files, {len(walk.steps)} entries into files"


def main(arguments: Sequence[str]) -> None:
    command, ticks = asyncio.run(walks())
    by_files = sorted(ticks, key=lambda walk: len(walk.files))
    usual = by_files[len(by_files) // 2]
    if "--all" in arguments:
        print(written(command), "", written(usual), "", sep="\n")
    print(summary("lin move", command))
    print(summary("a tick", usual))
    print(summary("the widest tick", by_files[-1]))


if __name__ == "__main__":
    main(sys.argv[1:])
