"""Formats the source of the clients' methods as the formatter would."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).parent.parent.parent / "iiwa_sim" / "client" / "_generated"
WIDTH = 110


class Kind(NamedTuple):
    """One of the two clients."""

    file: str
    name: str
    base: str
    module: str
    says: str
    define: str
    wait: str


def kinds(module: str, name: str) -> tuple[Kind, Kind]:
    """Both clients of a protocol: modules `module` and async_`module`, classes `name` and Async`name`."""
    return (
        Kind(f"{module}.py", name, "Connection", "blocking", "", "def", ""),
        Kind(
            f"async_{module}.py",
            f"Async{name}",
            "AsyncConnection",
            "asynchronous",
            " to be awaited",
            "async def",
            "await ",
        ),
    )


class Argument(NamedTuple):
    """One argument of a method, and its form in the request."""

    name: str
    type: str
    sent: str
    says: str


def call(head: str, parts: list[str], tail: str, *, indent: int | None = None, force: bool = False) -> str:
    """A call, or the head of a method, on one line if it fits."""
    one = f"{head}({', '.join(parts)}){tail}"
    column = len(head) - len(head.lstrip()) if indent is None else indent
    if len(one) + (0 if indent is None else indent) <= WIDTH and not force:
        return one
    inner = " " * (column + 4)
    comma = "" if force else ","
    return f"{head}(\n" + ",\n".join(f"{inner}{part}" for part in parts) + f"{comma}\n{' ' * column}){tail}"


def docs(summary: str, says: list[str]) -> str:
    """A docstring: the summary, and a line for each argument."""
    if not says:
        lines = textwrap.wrap(f'"""{summary}"""', WIDTH - 8)
        return textwrap.indent("\n".join(lines), " " * 8)
    lines = [*textwrap.wrap(f'"""{summary}', WIDTH - 8), ""]
    for each in says:
        lines += textwrap.wrap(each, WIDTH - 8, subsequent_indent="    ")
    return textwrap.indent("\n".join([*lines, '"""']), " " * 8)
