"""Tries a property of the tests at more seeds than they do.

`python -m tools.hunt tests.contact.test_energy:contact 0 10000` calls that function with each seed. It
asserts, and gives figures: told are the seeds at which it fails, with what was asserted, the values in that,
and what the function had drawn; in the end how many seeds were tried, and the largest of each figure.
"""

from __future__ import annotations

import argparse
import ast
import linecache
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from time import monotonic
from traceback import walk_tb
from types import FrameType

LONGEST = 160
"""Characters of a value that are told."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.hunt", description="a property at many seeds")
    parser.add_argument("function", help="of a seed, as tests.contact.test_energy:contact")
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument(
        "--seconds", type=float, default=float("inf"), help="to begin no seed later than that"
    )
    asked = parser.parse_args()
    module, _, name = asked.function.partition(":")
    function = getattr(import_module(module), name)
    largest: dict[str, tuple[float, int]] = {}
    tried, failed, began = 0, 0, monotonic()
    for seed in range(asked.first, asked.first + asked.count):
        if monotonic() - began > asked.seconds:
            break
        tried += 1
        try:
            figures = function(seed)
        except Exception as fault:  # noqa: BLE001  # whatever it is, it is told
            failed += 1
            print(f"{seed}: {told(fault)}", flush=True)
            continue
        for each, value in figures.items():
            largest[each] = max(largest.get(each, (value, seed)), (value, seed))
    print(f"{tried} seeds from {asked.first}, {failed} failed")
    for each, (value, seed) in largest.items():
        print(f"{each}: {value:.5g} at most, of seed {seed}")
    sys.exit(1 if failed else 0)


def told(fault: BaseException) -> str:
    """What has failed, in lines: the message or the assertion, the values of the names in it, and what the
    function that was called with the seed had in hand."""
    frames = list(walk_tb(fault.__traceback__))[1:]  # without our own
    if not frames:
        return f"{type(fault).__name__}: {fault}"
    frame, line = frames[-1]
    path = Path(frame.f_code.co_filename)
    text = _statement(path, line)
    kind = "" if isinstance(fault, AssertionError) else f"{type(fault).__name__}: "
    lines = [f"{kind}{fault}" if str(fault) else text]
    lines.append(f"at {path.name}:{line}" + (f", {text}" if str(fault) else ""))
    lines += [f"{each} = {value}" for each, value in _values(text, frame)]
    called = frames[0][0]
    if called is not frame:
        lines += [f"{each} = {_plain(value)}" for each, value in called.f_locals.items()]
    return "\n    ".join(lines)


def _statement(path: Path, line: int) -> str:
    """The innermost statement of a file at a line, as one line; as much of it as is read without its body."""
    lines = linecache.getlines(str(path))
    try:
        tree = ast.parse("".join(lines))
    except SyntaxError:
        return linecache.getline(str(path), line).strip()
    within = [
        each
        for each in ast.walk(tree)
        if isinstance(each, ast.stmt) and each.lineno <= line <= (each.end_lineno or each.lineno)
    ]
    innermost = max(within, key=lambda each: each.lineno, default=None)
    if innermost is None or hasattr(innermost, "body"):
        return linecache.getline(str(path), line).strip()
    return ast.unparse(innermost)


def _values(text: str, frame: FrameType) -> Iterator[tuple[str, str]]:
    """The names and attributes in a statement, and what they are in a frame; nothing is called for that."""
    try:
        tree = ast.parse(text)
    except SyntaxError:
        return
    known = {**frame.f_globals, **frame.f_locals}
    seen = set()
    for each in ast.walk(tree):
        if not isinstance(each, ast.Name | ast.Attribute) or not isinstance(each.ctx, ast.Load):
            continue
        name, *attributes = ast.unparse(each).split(".")
        if name not in known or not all(map(str.isidentifier, attributes)):
            continue
        value, whole = known[name], ".".join((name, *attributes))
        for attribute in attributes:
            value = vars(value).get(attribute) if hasattr(value, "__dict__") else None
        if whole not in seen and isinstance(value, float | int | str | tuple | list | dict):
            seen.add(whole)
            yield whole, _short(value)


def _plain(value: object) -> str:
    """A value, or what is plain of an object's attributes."""
    if isinstance(value, float | int | str | tuple | list | dict) or not hasattr(value, "__dict__"):
        return _short(value)
    plain = (float, int, str, tuple, list, dict)
    inside = ", ".join(f"{k}={_short(v)}" for k, v in vars(value).items() if isinstance(v, plain))
    return f"{type(value).__name__}({inside})"


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


if __name__ == "__main__":
    main()
