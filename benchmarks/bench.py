"""`make bench`: runs all benchmarks on one machine, side by side with a bare echo server.

`make bench ARGS="core --json FILE"` runs one part and writes JSON to a file. The exit code is 1 if a goal of
simulated time, CPU time or a ratio is missed; missed goals of wall time and of ratios of p99 are only
reported.

`make bench ARGS=--gate` is for `make nightly`: it runs the parts that have such goals, with a margin against
other work on the machine. A part with a missed goal is measured again, at most twice: the cost of our code
shows in each run, other load does not.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks import (
    beginnings,
    carrying,
    chains,
    core,
    corners,
    costs,
    dense_paths,
    durations,
    fleet,
    floods,
    moves,
    replies,
    rest,
    servo,
    start,
    status,
    view,
)
from benchmarks.figures import Figure, as_json, table


class Part(NamedTuple):
    """A benchmark module."""

    measure: Callable[[], list[Figure]]
    gated: bool
    """Whether it has goals that `make nightly` checks: neither of wall time nor of a p99."""
    of_gate: Callable[[], list[Figure]] | None = None
    """Measures a part for which `make nightly` has time, if that is not all."""


PARTS = {
    "replies": Part(replies.measure, gated=True),
    "moves": Part(moves.measure, gated=False),
    "core": Part(core.measure, gated=True),
    "carrying": Part(carrying.measure, gated=True),
    "start": Part(start.measure, gated=True, of_gate=start.gate),
    "beginnings": Part(beginnings.measure, gated=True),
    "durations": Part(durations.measure, gated=True),
    "chains": Part(chains.measure, gated=True),
    "corners": Part(corners.measure, gated=True),
    "costs": Part(costs.measure, gated=True),
    "dense": Part(dense_paths.measure, gated=True, of_gate=dense_paths.gate),
    "servo": Part(servo.measure, gated=False),
    "status": Part(status.measure, gated=True),
    "view": Part(view.measure, gated=False),
    "fleet": Part(fleet.measure, gated=False),
    "rest": Part(rest.measure, gated=True, of_gate=rest.gate),
    "floods": Part(floods.measure, gated=True, of_gate=floods.gate),
}
GATE_RUNS = 3


def main() -> int:
    """Measure, and print a table and JSON."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all without one")
    parser.add_argument(
        "--gate", action="store_true", help="only what CI holds, with margins for a busy machine"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the JSON there, not to the screen")
    options = parser.parse_args()
    unknown = [part for part in options.parts if part not in PARTS]
    if unknown:
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(PARTS)}")

    figures: list[Figure] = []
    missed: list[Figure] = []
    for name in options.parts or PARTS:
        part = PARTS[name]
        if options.gate and not part.gated:
            continue
        print(f"measuring {name} ...", file=sys.stderr)
        measure = part.of_gate if options.gate and part.of_gate is not None else part.measure
        found = measure()
        if not part.gated and any(figure.gated for figure in found):
            raise RuntimeError(f"{name} has goals that CI is to hold: call it gated")
        if options.gate:
            failing = held_back(found, measure)
            missed += failing
        else:
            missed += [figure for figure in found if figure.gated and not figure.met]
        figures += found
    print(table(figures))
    if options.json is not None:
        options.json.write_text(as_json(figures) + "\n")
    elif not options.gate:
        print(as_json(figures))
    for figure in missed:
        print(f"missed: {figure.name}: {figure.goal}", file=sys.stderr)
    return 1 if missed else 0


def held_back(found: Sequence[Figure], again: Callable[[], Iterable[Figure]]) -> list[Figure]:
    """The figures of `found` that miss their goal by more than the margin in every measurement."""
    missed = [figure for figure in found if not figure.held]
    for _ in range(GATE_RUNS - 1):
        if not missed:
            break
        print(f"again, for {'; '.join(figure.name for figure in missed)} ...", file=sys.stderr)
        held = {figure.name for figure in again() if figure.held}
        missed = [figure for figure in missed if figure.name not in held]
    return missed


if __name__ == "__main__":
    sys.exit(main())
