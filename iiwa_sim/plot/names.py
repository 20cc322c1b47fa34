"""The names of moves, by what was asked for: `LIN 0.5 r30` is kind, speed and blending radius (mm)."""

import re
from typing import NamedTuple

from iiwa_sim.controller.requests import Kind
from iiwa_sim.dialect.krc4.short import from_short, is_short
from iiwa_sim.dialect.krc4.table import load_krc4_table, understand
from iiwa_sim.dialect.ports import IIWA
from iiwa_sim.dialect.wire.table import Request
from iiwa_sim.dialect.wire.table_file import load_table

MOVE = " move"
"""The end of the names of the iiwa's commands that are moves."""
_TO = {"LIN": Kind.LIN, "LIA": Kind.LIN, "PTP": Kind.PTP, "PTA": Kind.PTP}  # KRC4 messages
_OF_A_JOINT = re.compile(r"v\d")


class Named(NamedTuple):
    """What a line says of a move."""

    name: str = ""
    blending_mm: float = 0.0


def named(request: Request) -> Named:
    """The name of a move that is a command in the iiwa's protocol."""
    command = request.command
    values = {each.name: value for each, value in zip(command.parameters, request.values, strict=True)}
    speeds = {value for name, value in values.items() if name == "speed" or _OF_A_JOINT.fullmatch(name)}
    blending_mm = values.get("blending", 0.0)
    words = [command.name.removesuffix(MOVE).upper()]
    if speeds:
        words.append("-".join(f"{each:g}" for each in sorted({min(speeds), max(speeds)})))
    if blending_mm:
        words.append(f"r{blending_mm:g}")
    return Named(" ".join(words), blending_mm)


def named_in(line: str) -> Named:
    """The name of a move that is a line of a recorded dialogue, in any dialect; empty for other lines."""
    if is_short(line):
        try:
            command = understand(from_short(line)).command
        except ValueError:
            return Named()
        known = load_krc4_table().commands.get(command)
        return Named(_TO[known.tag].value) if known is not None and known.tag in _TO else Named()
    request = load_table(IIWA).parse(line.encode())
    return named(request) if isinstance(request, Request) else Named()
